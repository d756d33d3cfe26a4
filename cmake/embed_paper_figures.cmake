# cmake -DFIGURES=paper_figures.csv -DOUTPUT=paper_figures.inc -P embed_paper_figures.cmake
# Writes the published figures as initialisers of `PaperFigure`. An unknown item or unit is a build error.
cmake_minimum_required(VERSION 3.25)

set(header "paper,item,condition,quantity,value,unit")
set(known_units Nm "Nm/deg" "Nm s/deg" "Nm/(deg/s)" N m mm "cm3/Nm" deg % -)
set(known_quantities RMSE MAE MAD STD BF "MAD ratio" "mean error ratio" "error percentage" torque twist "peak force" "force reduction"
  "volume per torque reduction" "weight reduction" "MAE improvement" parameters strain "stiffness ratio" b1 f1 f2
  d1 d2 d3 d4 k1 k2 k3 k4 k5 k6 k7 "spring movement" "outer radius" "inner radius" length "axial force" "force at flat" "volume per torque"
  "p0 spring" "p1 spring" "p2 spring" "p3 spring" "p0 gear" "p1 gear" "p2 gear" "p3 gear")
set(items_000 "Fig. 8" "Table 3" "section 3.1" "section 6.1")
set(items_001 "Fig. 6" "section 4.2")
set(items_002 "section II-B" "section II-C" "Table I" "Fig. 8" "Fig. 10" "Table III" "section III-C" "section IV-B" "section V")
set(items_003 "Table 2" "Table 3" "Fig. 4" "Fig. 7" "section 3.3" "section 4.2.1" "section 4.3")
set(items_004 "Table 4" "Table 5" "Table 6" "section 5.2")
set(items_boucwen published)  # sources: docs/results/benchmarks.md
set(items_emps published)

function(refuse line_number problem expected found)
  list(JOIN expected ", " expected)
  # CMake breaks lines that are not indented.
  message(FATAL_ERROR "\n  ${FIGURES}:${line_number}: ${problem}\n  expected: ${expected}\n  found: ${found}")
endfunction()

file(STRINGS ${FIGURES} lines)
list(POP_FRONT lines first)
if(NOT first STREQUAL header)
  refuse(1 "the header is not the expected one" "${header}" "${first}")
endif()

set(initialisers "")
set(keys "")
set(line_number 1)
foreach(line IN LISTS lines)
  math(EXPR line_number "${line_number} + 1")
  if(line MATCHES "[\"\\]" OR NOT line MATCHES "^([^,]+),([^,]+),([^,]+),([^,]+),([^,]+),([^,]+)$")
    refuse(${line_number} "not a line of six fields" "${header} (without quotes and backslashes)" "${line}")
  endif()
  set(paper "${CMAKE_MATCH_1}")
  set(item "${CMAKE_MATCH_2}")
  set(condition "${CMAKE_MATCH_3}")
  set(quantity "${CMAKE_MATCH_4}")
  set(value "${CMAKE_MATCH_5}")
  set(unit "${CMAKE_MATCH_6}")
  if(NOT DEFINED items_${paper})
    refuse(${line_number} "unknown paper" "000;001;002;003;004;boucwen;emps" "${paper}")
  elseif(NOT item IN_LIST items_${paper})
    refuse(${line_number} "unknown item of paper ${paper}" "${items_${paper}}" "${item}")
  elseif(NOT quantity IN_LIST known_quantities)
    refuse(${line_number} "unknown quantity" "${known_quantities}" "${quantity}")
  elseif(NOT unit IN_LIST known_units)
    refuse(${line_number} "unknown unit" "${known_units}" "${unit}")
  elseif(NOT value MATCHES "^-?[0-9]+\\.?[0-9]*(e-?[0-9]+)?$")
    refuse(${line_number} "not a number" "for example 0.6578 or 7.53e-6" "${value}")
  endif()
  set(key "${paper}|${item}|${condition}|${quantity}")
  if(key IN_LIST keys)
    refuse(${line_number} "the figure occurs twice" "one line for each figure" "${line}")
  endif()
  list(APPEND keys "${key}")
  string(APPEND initialisers
    "PaperFigure{\"${paper}\", \"${item}\", \"${condition}\", \"${quantity}\", \"${value}\", \"${unit}\", ${value}},\n")
endforeach()
file(WRITE ${OUTPUT} "${initialisers}")
