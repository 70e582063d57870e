# Toolchain that cross-compiles for arm64, the other processor of vehicle computers. Only libraries that link nothing
# can be built with it: of other people's it takes the headers, which are this machine's.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_PREFIX_PATH /usr/lib/x86_64-linux-gnu/cmake)
set(CMAKE_LIBRARY_PATH /usr/lib/x86_64-linux-gnu)
# GCC 12 sees strings run over that do not (its bug 105329), and notes what GCC 10 changed in calls.
set(CMAKE_CXX_FLAGS_INIT "-Wno-array-bounds -Wno-stringop-overflow -Wno-psabi")
