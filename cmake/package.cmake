# What is installed, in parts: flexor, camera and boards are the Debian packages that script/deb makes, dev is for
# find_package(flexor). The programs find one another beside /proc/self/exe, and carry what they need; images, models and
# documents are for people.
install(TARGETS flexor_camera_program COMPONENT camera)
install(TARGETS flexor_cosim_program COMPONENT boards)
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR} PATTERN CMakeLists.txt EXCLUDE)
install(FILES README.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES firmware/README.md DESTINATION ${CMAKE_INSTALL_DOCDIR}/firmware)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME copyright)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR}-camera RENAME copyright COMPONENT camera)
install(FILES cosim/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR}-boards RENAME copyright COMPONENT boards)
install(CODE "execute_process(COMMAND \"${PROJECT_SOURCE_DIR}/script/manual\" \"$<TARGET_FILE:flexor>\"
  \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_DATADIR}\" COMMAND_ERROR_IS_FATAL ANY)")

# find_package(flexor): the rooms that flexor_exported() names.
set(dev ${CMAKE_INSTALL_LIBDIR}/cmake/flexor)
install(DIRECTORY runtime host DESTINATION include/flexor COMPONENT dev FILES_MATCHING PATTERN *.hpp
  PATTERN camera EXCLUDE PATTERN *_test.hpp EXCLUDE PATTERN test_*.hpp EXCLUDE PATTERN fuzz_*.hpp EXCLUDE PATTERN random_*.hpp EXCLUDE)
install(FILES firmware/markers.hpp DESTINATION include/flexor/firmware COMPONENT dev)
install(EXPORT flexor NAMESPACE flexor:: FILE flexor-targets.cmake DESTINATION ${dev} COMPONENT dev)
file(CONFIGURE OUTPUT flexor-config.cmake @ONLY CONTENT [[
include(CMakeFindDependencyMacro)
foreach(library Eigen3 nlohmann_json Threads)
  find_dependency(${library})
endforeach()
include(${CMAKE_CURRENT_LIST_DIR}/flexor-targets.cmake)
]])
include(CMakePackageConfigHelpers)
write_basic_package_version_file(flexor-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/flexor-config.cmake ${PROJECT_BINARY_DIR}/flexor-config-version.cmake DESTINATION ${dev} COMPONENT dev)

set(CPACK_GENERATOR DEB)
set(CPACK_COMPONENTS_ALL flexor camera boards)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_CONTACT "The Flexor developers")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_FLEXOR_PACKAGE_NAME flexor)
set(CPACK_COMPONENT_FLEXOR_DESCRIPTION "flex-sensor glove as a measuring instrument
Records glove and camera, identifies what cloth and sensor do wrong, and proves
the correction on data that it never saw. Has the images for both boards.")
set(CPACK_DEBIAN_FLEXOR_PACKAGE_RECOMMENDS avrdude)
set(CPACK_DEBIAN_FLEXOR_PACKAGE_SUGGESTS "flexor-camera, flexor-boards, gnuplot-nox")
set(CPACK_COMPONENT_CAMERA_DESCRIPTION "Flexor: angles of fingers from videos and cameras")
set(CPACK_COMPONENT_BOARDS_DESCRIPTION "Flexor: both boards simulated, instruction by instruction")
set(CPACK_DEBIAN_CAMERA_PACKAGE_DEPENDS "flexor (= ${PROJECT_VERSION})")
set(CPACK_DEBIAN_BOARDS_PACKAGE_DEPENDS "flexor (= ${PROJECT_VERSION})")
include(CPack)
