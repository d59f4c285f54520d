# `cmake --install`: the headers and static libraries of the layers, the program, and the package by
# which find_package(upswing) finds them. The folder can be moved: nothing in it is an absolute path.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(UPSWING_LAYERS base nn pendulum rl control os mujoco report agents runs judge)
set(UPSWING_EXTRAS machine realaigym deploy)
list(TRANSFORM UPSWING_EXTRAS PREPEND upswing- OUTPUT_VARIABLE UPSWING_PROGRAMS)
list(APPEND UPSWING_PROGRAMS upswing)
set(UPSWING_PACKAGE ${CMAKE_INSTALL_LIBDIR}/cmake/upswing)
set(UPSWING_INSTALLED_MUJOCO ${CMAKE_INSTALL_LIBDIR}/upswing/mujoco)

# The libraries of folders in FOLDER, and their headers, which are included from include/upswing.
function(upswing_install_layers FOLDER DESTINATION)
  foreach(LAYER IN LISTS ARGN)
    install(TARGETS upswing_${LAYER} EXPORT upswing)
    # Without headers for tests, and without parts of kernels.
    install(DIRECTORY ${FOLDER}/${LAYER} DESTINATION ${DESTINATION}
            FILES_MATCHING PATTERN "*.h" PATTERN "*.inc"
            PATTERN "*testing.h" EXCLUDE PATTERN "*-inl.h" EXCLUDE PATTERN "testdata" EXCLUDE)
  endforeach()
endfunction()
upswing_install_layers(src include/upswing ${UPSWING_LAYERS})
upswing_install_layers(extras include/upswing/extras ${UPSWING_EXTRAS})
install(EXPORT upswing NAMESPACE upswing:: FILE upswing-targets.cmake DESTINATION ${UPSWING_PACKAGE})

configure_package_config_file(cmake/upswing-config.cmake.in upswing-config.cmake
  INSTALL_DESTINATION ${UPSWING_PACKAGE} PATH_VARS UPSWING_INSTALLED_MUJOCO)
# Before 1.0, a minor version may change anything.
write_basic_package_version_file(upswing-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/upswing-config.cmake
              ${CMAKE_CURRENT_BINARY_DIR}/upswing-config-version.cmake cmake/mujoco.cmake
        DESTINATION ${UPSWING_PACKAGE})

# Packages have shared libraries of their own in lib/upswing, and the wheel's MuJoCo comes along with its
# headers and licences.
file(RELATIVE_PATH FROM_BIN /${CMAKE_INSTALL_BINDIR} /${CMAKE_INSTALL_LIBDIR}/upswing)
set(UPSWING_RUN_PATH "$ORIGIN/${FROM_BIN}")
if(NOT mujoco_FOUND)
  install(DIRECTORY ${UPSWING_MUJOCO}/ DESTINATION ${UPSWING_INSTALLED_MUJOCO})
  list(APPEND UPSWING_RUN_PATH "$ORIGIN/${FROM_BIN}/mujoco/lib")
endif()
install(TARGETS ${UPSWING_PROGRAMS})
foreach(NAME IN LISTS UPSWING_PROGRAMS)
  upswing_install_run_path(${NAME} ${CMAKE_INSTALL_BINDIR} PATHS ${UPSWING_RUN_PATH})
endforeach()
install(FILES LICENSE README.md CHANGELOG.md CITATION.cff DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY web/public/agents DESTINATION ${CMAKE_INSTALL_DATADIR}/upswing/page) # shipped policies
install(DIRECTORY examples DESTINATION ${CMAKE_INSTALL_DATADIR}/upswing PATTERN "*_test.py" EXCLUDE
        PATTERN "__pycache__" EXCLUDE)
install(PROGRAMS examples/slurm.sh DESTINATION ${CMAKE_INSTALL_DATADIR}/upswing/examples)
