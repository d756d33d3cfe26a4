# cmake -DTABLE=file.csv -DHEADER=a,b,c -DOUTPUT=file.inc -P embed_csv.cmake
# Writes the lines of a table below its header as initialisers of texts. Another header, a line with another number of fields
# and a quote or backslash are build errors. Fields may be empty.
cmake_minimum_required(VERSION 3.25)

function(refuse line_number problem)
  # CMake breaks lines that are not indented.
  message(FATAL_ERROR "\n  ${TABLE}:${line_number}: ${problem}\n  expected: ${HEADER} (without quotes and backslashes)\n  found: ${ARGN}")
endfunction()

string(REGEX MATCHALL "," commas "${HEADER}")
list(LENGTH commas expected)
file(READ ${TABLE} text)
# A semicolon would separate elements of a list, and brackets would join them.
string(REPLACE ";" "<semicolon>" text "${text}")
string(REPLACE "[" "<open>" text "${text}")
string(REPLACE "]" "<close>" text "${text}")
string(REGEX REPLACE "\n$" "" text "${text}")
string(REPLACE "\n" ";" lines "${text}")
list(POP_FRONT lines first)
if(NOT first STREQUAL HEADER)
  refuse(1 "the header is not the expected one" "${first}")
endif()
set(initialisers "")
set(line_number 1)
foreach(line IN LISTS lines)
  math(EXPR line_number "${line_number} + 1")
  string(REGEX MATCHALL "," commas "${line}")
  list(LENGTH commas count)
  if(line MATCHES "[\"\\]" OR NOT count EQUAL expected)
    refuse(${line_number} "not a line of the table" "${line}")
  endif()
  string(REPLACE "," "\", \"" fields "${line}")
  string(APPEND initialisers "{\"${fields}\"},\n")
endforeach()
string(REPLACE "<semicolon>" ";" initialisers "${initialisers}")
string(REPLACE "<open>" "[" initialisers "${initialisers}")
string(REPLACE "<close>" "]" initialisers "${initialisers}")
file(WRITE ${OUTPUT} "${initialisers}")
