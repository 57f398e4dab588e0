# Included by gRPC's own CMake project: reads its headers once, not four hundred times.
if(PROJECT_NAME STREQUAL "grpc")
  set(HEADERS
    include/grpc/support/port_platform.h  # comes before everything else
    src/core/lib/channel/channel_stack.h
    src/core/lib/config/core_configuration.h
    src/core/lib/json/json_object_loader.h
    src/core/lib/load_balancing/lb_policy.h
    src/core/lib/resolver/resolver.h
    src/core/lib/security/credentials/credentials.h
    src/core/lib/surface/call.h
    src/core/lib/transport/transport.h)
  list(TRANSFORM HEADERS REPLACE "(.+)"
    "$<$<COMPILE_LANGUAGE:CXX>:${CMAKE_CURRENT_SOURCE_DIR}/\\1>")
  cmake_language(DEFER CALL target_precompile_headers grpc PRIVATE ${HEADERS})
endif()
