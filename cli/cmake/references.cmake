# Writes into OUTPUT what PROGRAM says of itself: trihedron.1, trihedron.bash, trihedron.zsh, trihedron.fish.
file(MAKE_DIRECTORY ${OUTPUT})
execute_process(COMMAND ${PROGRAM} man OUTPUT_FILE ${OUTPUT}/trihedron.1 COMMAND_ERROR_IS_FATAL ANY)
foreach(shell bash zsh fish)
  execute_process(COMMAND ${PROGRAM} completion ${shell} OUTPUT_FILE ${OUTPUT}/trihedron.${shell} COMMAND_ERROR_IS_FATAL ANY)
endforeach()
