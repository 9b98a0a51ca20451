# Writes FILE, which ctest includes: one test for each suite of the GoogleTest program PROGRAM, called unit.SUITE. Unit tests
# take less time than the start of their program, so that a test for each of them would take half as long again.
#   cmake -DPROGRAM=... -DFILE=... -P suites.cmake
execute_process(COMMAND ${PROGRAM} --gtest_list_tests OUTPUT_VARIABLE list COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "(^|\n)[A-Za-z0-9_/]+[.]" suites "${list}")
set(tests)
foreach(suite IN LISTS suites)
  string(REGEX REPLACE "[\n.]" "" suite "${suite}")
  string(APPEND tests "add_test(\"unit.${suite}\" \"${PROGRAM}\" \"--gtest_filter=${suite}.*\")\n"
    "set_tests_properties(\"unit.${suite}\" PROPERTIES TIMEOUT 600)\n")
endforeach()
file(WRITE ${FILE} "${tests}")
