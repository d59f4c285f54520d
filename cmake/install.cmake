# `cmake --install`: the programs, the page's policies and examples; except on Windows also the headers and static
# libraries of the layers, and the package by which find_package(upswing) finds them. The folder can be
# moved: nothing in it is an absolute path.
include(GNUInstallDirs)
set(UPSWING_LAYERS base nn pendulum rl control os mujoco report agents runs judge)
set(UPSWING_EXTRAS machine realaigym deploy)
list(TRANSFORM UPSWING_EXTRAS PREPEND upswing- OUTPUT_VARIABLE UPSWING_PROGRAMS)
list(APPEND UPSWING_PROGRAMS upswing)
set(UPSWING_INSTALLED_MUJOCO ${CMAKE_INSTALL_LIBDIR}/upswing/mujoco)
if(WIN32)
  # The system looks for a program's libraries in its folder.
  install(FILES ${UPSWING_MUJOCO}/lib/mujoco.dll DESTINATION ${CMAKE_INSTALL_BINDIR})
else()
  include(cmake/install_library.cmake)
endif()

# Packages have shared libraries of their own in lib/upswing, and the wheel's MuJoCo comes along with its
# headers and licences.
file(RELATIVE_PATH FROM_BIN /${CMAKE_INSTALL_BINDIR} /${CMAKE_INSTALL_LIBDIR}/upswing)
set(UPSWING_RUN_PATH "$ORIGIN/${FROM_BIN}")
if(NOT mujoco_FOUND AND NOT WIN32)
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
install(DIRECTORY configs/studies DESTINATION ${CMAKE_INSTALL_DATADIR}/upswing/configs)
install(PROGRAMS examples/slurm.sh DESTINATION ${CMAKE_INSTALL_DATADIR}/upswing/examples)
