# find_package(gpom) gives gpom::gpom, the shared library, and gpom::static.
get_filename_component(_gpom_prefix "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)

if(NOT TARGET gpom::gpom)
  add_library(gpom::gpom SHARED IMPORTED)
  set_target_properties(gpom::gpom PROPERTIES
    IMPORTED_LOCATION "${_gpom_prefix}/lib/libgpom.so"
    IMPORTED_NO_SONAME FALSE
    INTERFACE_INCLUDE_DIRECTORIES "${_gpom_prefix}/include")

  add_library(gpom::static STATIC IMPORTED)
  set_target_properties(gpom::static PROPERTIES
    IMPORTED_LOCATION "${_gpom_prefix}/lib/libgpom.a"
    IMPORTED_LINK_INTERFACE_LANGUAGES C
    INTERFACE_INCLUDE_DIRECTORIES "${_gpom_prefix}/include"
    INTERFACE_LINK_LIBRARIES m)
endif()
unset(_gpom_prefix)
