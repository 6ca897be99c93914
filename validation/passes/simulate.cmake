# cmake -D PROGRAM=… -D SCENARIO=… -D PASS=… -P simulate.cmake
# Makes the directory PASS and the file PASS.nc where they are not newer than the program and the scenario.
cmake_path(GET PASS PARENT_PATH parent)
file(MAKE_DIRECTORY ${parent})
foreach(pass IN ITEMS ${PASS} ${PASS}.nc)
  if(${PROGRAM} IS_NEWER_THAN ${pass} OR ${SCENARIO} IS_NEWER_THAN ${pass})
    execute_process(COMMAND ${PROGRAM} --quiet simulate ${SCENARIO} -o ${pass} COMMAND_ERROR_IS_FATAL ANY)
  endif()
endforeach()
