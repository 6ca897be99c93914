# ARM Cortex-M7 with double-precision FPU, without an operating system: Debian's gcc-arm-none-eabi and newlib, files of the host by
# semihosting.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR arm)
set(CMAKE_CXX_COMPILER arm-none-eabi-g++)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
set(CMAKE_CXX_FLAGS_INIT "-mcpu=cortex-m7 -mthumb -mfpu=fpv5-d16 -mfloat-abi=hard")
set(CMAKE_EXE_LINKER_FLAGS_INIT
  "--specs=rdimon.specs -T ${CMAKE_CURRENT_LIST_DIR}/mps2-an500.ld -Wl,-Map=fly.map")
set(TRIHEDRON_PROBE cortex-m7/probe.cpp)
set(TRIHEDRON_STARTUP cortex-m7/startup.cpp)
