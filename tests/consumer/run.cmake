# Installs a build into a fresh prefix, builds the consumer against nothing but that prefix, and runs it.
# cmake -D BUILD=… -D WORK=… -D SOURCE=… -D STL=… -D GENERATOR=… -P run.cmake
foreach(name BUILD WORK SOURCE STL GENERATOR)
  if(NOT DEFINED ${name})
    message(FATAL_ERROR "run.cmake: -D ${name}=… is missing")
  endif()
endforeach()
file(REMOVE_RECURSE ${WORK})
foreach(step
    "${CMAKE_COMMAND};--install;${BUILD};--prefix;${WORK}/prefix"
    "${CMAKE_COMMAND};-S;${SOURCE};-B;${WORK}/build;-G;${GENERATOR};-DCMAKE_PREFIX_PATH=${WORK}/prefix;-DCMAKE_BUILD_TYPE=Release"
    "${CMAKE_COMMAND};--build;${WORK}/build"
    "${WORK}/build/consumer;${STL}"
    "${WORK}/prefix/bin/slabwright;--version")
  execute_process(COMMAND ${step} RESULT_VARIABLE result COMMAND_ECHO STDOUT)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "failed with ${result}: ${step}")
  endif()
endforeach()
