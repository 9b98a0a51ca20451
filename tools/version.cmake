# Writes the header with the version and the commit; run at every build, so that the commit is never stale. The file
# is left alone when nothing changed, so that nothing is compiled again.
# Needs DUET_SOURCE_DIR, DUET_VERSION and DUET_HEADER.
set(DUET_GIT_COMMIT "unknown commit")
find_program(GIT git)
if(GIT)
  execute_process(COMMAND ${GIT} -C ${DUET_SOURCE_DIR} describe --always --dirty=-changed --abbrev=12 --exclude=*
    OUTPUT_VARIABLE commit RESULT_VARIABLE failed OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  if(NOT failed)
    set(DUET_GIT_COMMIT ${commit})
  endif()
endif()
configure_file(${CMAKE_CURRENT_LIST_DIR}/version.h.in ${DUET_HEADER} @ONLY)
