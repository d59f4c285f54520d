# The installed library: headers, static libraries and the package upswing. Read by cmake/install.cmake.
include(CMakePackageConfigHelpers)
set(UPSWING_PACKAGE ${CMAKE_INSTALL_LIBDIR}/cmake/upswing)

# The libraries of folders in FOLDER, and their headers, which are included from include/upswing.
function(upswing_install_layers FOLDER DESTINATION)
  foreach(LAYER IN LISTS ARGN)
    install(TARGETS upswing_${LAYER} EXPORT upswing)
    # Without headers for tests or Windows, and without parts of kernels.
    install(DIRECTORY ${FOLDER}/${LAYER} DESTINATION ${DESTINATION}
            FILES_MATCHING PATTERN "*.h" PATTERN "*.inc"
            PATTERN "*testing.h" EXCLUDE PATTERN "*-inl.h" EXCLUDE PATTERN "win32.h" EXCLUDE PATTERN "testdata" EXCLUDE)
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
