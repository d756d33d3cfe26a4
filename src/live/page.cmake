# The script, the style and the document of the page of joints: bundled from web/src where esbuild is installed (npm ci in
# web/), else the committed bundle, which a test compares with the sources.
set(web ${PROJECT_SOURCE_DIR}/web)
set(bundle ${web}/dist)
find_program(TORSIO_NODE NAMES node nodejs)
mark_as_advanced(TORSIO_NODE)
if(TORSIO_NODE AND EXISTS ${web}/node_modules/esbuild)
  set(bundle ${CMAKE_CURRENT_BINARY_DIR})
  file(GLOB web_sources CONFIGURE_DEPENDS ${web}/src/*)
  add_custom_command(OUTPUT ${bundle}/live.js ${bundle}/live.css ${bundle}/live.html
    COMMAND ${TORSIO_NODE} ${web}/bundle.mjs ${bundle}
    DEPENDS ${web_sources} ${web}/bundle.mjs ${web}/package-lock.json
    WORKING_DIRECTORY ${web} VERBATIM)
endif()
set(page_files ${CMAKE_CURRENT_BINARY_DIR}/page_files.cpp)
add_custom_command(OUTPUT ${page_files}
  COMMAND ${CMAKE_COMMAND}
    -DFILES=live_script=${bundle}/live.js,live_style=${bundle}/live.css,live_html=${bundle}/live.html
    -DHEADER=live/page_files.hpp -DOUTPUT=${page_files} -P ${PROJECT_SOURCE_DIR}/cmake/embed_page_files.cmake
  DEPENDS ${bundle}/live.js ${bundle}/live.css ${bundle}/live.html ${PROJECT_SOURCE_DIR}/cmake/embed_page_files.cmake VERBATIM)
# In the folder whose target compiles it: a generated file is known only there.
target_sources(torsio_live PRIVATE ${page_files})
add_custom_target(torsio_live_files DEPENDS ${page_files})
add_dependencies(torsio_live torsio_live_files)
set_source_files_properties(${page_files} TARGET_DIRECTORY torsio_live PROPERTIES GENERATED ON)
