# 32-bit SPARC under user-mode emulation; linked statically, so that no libraries of it are needed to run.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR sparc)
set(CMAKE_CXX_COMPILER sparc64-linux-gnu-g++)
set(CMAKE_CXX_FLAGS_INIT "-m32 ")
set(CMAKE_EXE_LINKER_FLAGS_INIT "-static")
