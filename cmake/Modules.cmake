# One way to make a module, so that the dependency directions cannot be got wrong by accident.
#
#   cli → campaign, report, plan; campaign → lanes → ground, sim; io → records → core; python → ground, sim, io
#
# trihedron_module(<name> [SOURCES …] [MODULES …] [LIBRARIES …] [PRIVATE_LIBRARIES …])
#   makes the target trihedron_<name> with the alias trihedron::<name>; MODULES must be allowed by the table below.
# trihedron_test(<module> <file.cpp>… [LIBRARIES …] [LONG <Suite.Name>…] [THOROUGH <Suite.Name>…]
#     [SAMPLE_PASSES <Suite.Name>…])
#   makes the Google Test program <module>_test, linked with the module if there is one of that name, and registers its tests as
#   <module>.<Suite>.<Name>, under the sanitizers as <module>.part_0 to part_3. Those that match LONG (with * and ?) get the label `long`:
#   they fly many times for a statistic, take no path of their own, and are left out under the sanitizers, where they would take an hour.
#   Those that match THOROUGH, by name or all with *, get the label `long-thorough`, and `make test` leaves them to `make thorough`.
#   Those that match SAMPLE_PASSES are long as well, and CTest makes the passes of validation/passes before them.
# trihedron_pytest(<name> <file.py>)
#   registers the tests of a Python file as one test; they find the build directory in TRIHEDRON_BUILD. Those marked `long` are
#   left out under the sanitizers as well.

set(TRIHEDRON_core_MAY_USE)
set(TRIHEDRON_records_MAY_USE core)
set(TRIHEDRON_sim_MAY_USE core records)
set(TRIHEDRON_io_MAY_USE core records)
set(TRIHEDRON_ground_MAY_USE core records)
set(TRIHEDRON_plan_MAY_USE core records sim ground)
set(TRIHEDRON_lanes_MAY_USE core records sim ground)
set(TRIHEDRON_campaign_MAY_USE core records sim ground lanes)
set(TRIHEDRON_report_MAY_USE core records ground campaign)
set(TRIHEDRON_cli_MAY_USE core records sim io ground plan campaign report)
set(TRIHEDRON_python_MAY_USE core records sim io ground)

# Within ground, from room to room.
set(TRIHEDRON_ground_tasks_MAY_USE)
set(TRIHEDRON_ground_linear_MAY_USE)
set(TRIHEDRON_ground_model_MAY_USE)
set(TRIHEDRON_ground_clocks_MAY_USE linear model)
set(TRIHEDRON_ground_evaluate_MAY_USE tasks linear model)
set(TRIHEDRON_ground_onboard_MAY_USE tasks model)
set(TRIHEDRON_ground_batch_MAY_USE tasks linear model onboard)
set(TRIHEDRON_ground_choose_MAY_USE tasks linear model evaluate onboard batch)
set(TRIHEDRON_ground_application_MAY_USE model onboard choose)
set(TRIHEDRON_ground_judge_MAY_USE model clocks evaluate)
set(TRIHEDRON_ground_inspect_MAY_USE)
set(TRIHEDRON_ground_observe_MAY_USE tasks model onboard batch choose)
set(TRIHEDRON_ground_calibrate_MAY_USE tasks model clocks evaluate onboard batch choose judge)

# Of a library that the Python module, which is a shared one, may be linked of. Its functions may call each other straight, as in a program.
# With Python or without, so that who builds the program first, and then all, compiles once; it makes no difference that can be measured.
function(trihedron_position_independent target)
  if(NOT CMAKE_CROSSCOMPILING)
    set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-fno-semantic-interposition>)
  endif()
endfunction()

function(trihedron_module name)
  cmake_parse_arguments(arg "" "" "SOURCES;MODULES;LIBRARIES;PRIVATE_LIBRARIES" ${ARGN})
  set(target trihedron_${name})
  if(arg_SOURCES)
    add_library(${target} STATIC ${arg_SOURCES})
    set(scope PUBLIC)
    target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:trihedron_warnings> ${arg_PRIVATE_LIBRARIES})
    if(name IN_LIST TRIHEDRON_python_MAY_USE)
      trihedron_position_independent(${target})
    endif()
  else()
    add_library(${target} INTERFACE)
    set(scope INTERFACE)
  endif()
  add_library(trihedron::${name} ALIAS ${target})
  target_compile_features(${target} ${scope} cxx_std_20)
  target_include_directories(${target} ${scope}
    $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:include>)
  foreach(module IN LISTS arg_MODULES)
    if(NOT module IN_LIST TRIHEDRON_${name}_MAY_USE)
      message(FATAL_ERROR "module ${name} may not use module ${module}: see cmake/Modules.cmake")
    endif()
    target_link_libraries(${target} ${scope} trihedron::${module})
  endforeach()
  target_link_libraries(${target} ${scope} ${arg_LIBRARIES})
endfunction()

# Our own libraries that the targets of ARGN are linked with, these included, each after those that it uses.
function(trihedron_libraries_of result)
  set(found)
  foreach(library IN LISTS ARGN)
    string(REGEX REPLACE "^\\$<LINK_ONLY:(.*)>$" "\\1" library "${library}")
    string(REPLACE "trihedron::" "trihedron_" library "${library}")
    if(NOT library MATCHES "^trihedron_[a-z_]+$" OR NOT TARGET ${library})
      continue()
    endif()
    get_target_property(type ${library} TYPE)
    if(type STREQUAL "STATIC_LIBRARY")
      get_target_property(uses ${library} INTERFACE_LINK_LIBRARIES)
      trihedron_libraries_of(used ${uses})
      list(APPEND found ${used} ${library})
    endif()
  endforeach()
  list(REMOVE_DUPLICATES found)
  set(${result} ${found} PARENT_SCOPE)
endfunction()

function(trihedron_test module)
  if(NOT TRIHEDRON_BUILD_TESTS)
    return()
  endif()
  cmake_parse_arguments(arg "" "" "LIBRARIES;LONG;THOROUGH;SAMPLE_PASSES" ${ARGN})
  add_executable(${module}_test ${arg_UNPARSED_ARGUMENTS})
  if(TARGET trihedron::${module})
    target_link_libraries(${module}_test PRIVATE trihedron::${module})
  endif()
  target_link_libraries(${module}_test PRIVATE ${arg_LIBRARIES} GTest::gmock GTest::gtest_main rapidcheck trihedron_warnings)
  # The tests themselves need no speed, and without it compile in two thirds of the time, with clang in a third. What they test is optimised
  # in its own library, which is linked before them: of a function that both hold, one of Eigen or another inline one, the linker takes the first.
  # Under sanitizers they take an eighth less without line numbers; those of what is tested stay.
  set(as_tests -O0 $<$<BOOL:${TRIHEDRON_SANITIZE}>:-g0>)
  # These the compiler reads once for all tests, also where files are compiled in units.
  if(NOT TARGET trihedron_test_headers)
    file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/test_headers.cpp CONTENT "")
    add_library(trihedron_test_headers OBJECT ${PROJECT_BINARY_DIR}/test_headers.cpp)
    target_link_libraries(trihedron_test_headers PRIVATE trihedron::core GTest::gmock GTest::gtest trihedron_warnings)
    target_compile_options(trihedron_test_headers PRIVATE ${as_tests})
    target_precompile_headers(trihedron_test_headers PRIVATE <Eigen/Dense> <gmock/gmock.h> <gtest/gtest.h>)
    set_target_properties(trihedron_test_headers PROPERTIES DISABLE_PRECOMPILE_HEADERS OFF)
  endif()
  target_precompile_headers(${module}_test REUSE_FROM trihedron_test_headers)
  set_target_properties(${module}_test PROPERTIES DISABLE_PRECOMPILE_HEADERS OFF)
  target_compile_options(${module}_test PRIVATE ${as_tests})
  trihedron_libraries_of(libraries trihedron::${module} ${arg_LIBRARIES})
  list(TRANSFORM libraries REPLACE "(.+)" "$<TARGET_FILE:\\1>" OUTPUT_VARIABLE files)
  list(JOIN files " " files)
  target_link_options(${module}_test PRIVATE "SHELL:-Wl,--whole-archive ${files} -Wl,--no-whole-archive")
  set(discovery TEST_PREFIX ${module}. DISCOVERY_TIMEOUT 60)
  set(properties PROPERTIES TIMEOUT 300)
  set(environment)
  if(TRIHEDRON_COVERAGE AND module MATCHES "^core")
    # One file for each program, to which its processes add their counts one after another.
    set(environment "LLVM_PROFILE_FILE=${PROJECT_BINARY_DIR}/coverage/%m.profraw")
    list(APPEND properties ENVIRONMENT ${environment})
  endif()
  string(JOIN ":" long ${arg_LONG})
  string(JOIN ":" thorough ${arg_THOROUGH})
  string(JOIN ":" on_passes ${arg_SAMPLE_PASSES})
  set(others "-${long}:${thorough}:${on_passes}")
  if(TRIHEDRON_SANITIZE)
    # In four processes. The start of one takes longer than most of these tests do.
    foreach(part RANGE 3)
      add_test(NAME ${module}.part_${part} COMMAND ${module}_test "--gtest_filter=${others}")
      set_tests_properties(${module}.part_${part} PROPERTIES TIMEOUT 900
        ENVIRONMENT "GTEST_TOTAL_SHARDS=4;GTEST_SHARD_INDEX=${part};${environment}")
    endforeach()
  else()
    gtest_discover_tests(${module}_test ${discovery} TEST_FILTER "${others}" ${properties})
  endif()
  if(arg_LONG)
    gtest_discover_tests(${module}_test ${discovery} TEST_FILTER "${long}-${thorough}" TEST_LIST ${module}_long_tests ${properties} LABELS long COST 100)
  endif()
  if(arg_THOROUGH)
    gtest_discover_tests(${module}_test ${discovery} TEST_FILTER "${thorough}" TEST_LIST ${module}_thorough_tests
      ${properties} LABELS long-thorough COST 300)
  endif()
  if(arg_SAMPLE_PASSES)
    target_link_libraries(${module}_test PRIVATE trihedron_sample_passes)
    gtest_discover_tests(${module}_test ${discovery} TEST_FILTER "${on_passes}" TEST_LIST ${module}_tests_on_passes
      ${properties} LABELS long COST 200 FIXTURES_REQUIRED sample_passes)
  endif()
endfunction()

function(trihedron_pytest name file)
  add_test(NAME ${name}.pytest COMMAND ${TRIHEDRON_PYTHON} -m pytest -q -p no:cacheprovider -o markers=long
    -m "$<IF:$<BOOL:${TRIHEDRON_SANITIZE}>,not long,>" ${file})
  # The cost lets CTest start these first, and those that are long before others: begun last, they would run on alone for minutes.
  set_tests_properties(${name}.pytest PROPERTIES TIMEOUT 900 COST 1000
    ENVIRONMENT "TRIHEDRON_BUILD=${PROJECT_BINARY_DIR};PYTHONDONTWRITEBYTECODE=1")
endfunction()
