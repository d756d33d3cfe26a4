# cmake -DNODE=node -DWEB=web -DFOLDER=scratch -P committed_bundle.cmake
execute_process(COMMAND ${NODE} ${WEB}/bundle.mjs ${FOLDER} WORKING_DIRECTORY ${WEB} COMMAND_ERROR_IS_FATAL ANY)
foreach(file report.js report.css live.js live.css live.html)
  execute_process(COMMAND ${CMAKE_COMMAND} -E compare_files ${FOLDER}/${file} ${WEB}/dist/${file} RESULT_VARIABLE differs)
  if(differs)
    message(FATAL_ERROR "web/dist/${file} is not the bundle of web/src: run `npm ci && npm run build` in web/ and commit it")
  endif()
endforeach()
