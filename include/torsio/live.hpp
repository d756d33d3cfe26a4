#pragma once

// Start here to show joints in a browser, or to give their telemetry to programs of others. Needs libwebsockets.
//
//   TelemetryPublisher   telemetry for PlotJuggler and Foxglove
//   WebServer            files from memory and WebSockets, in a thread of its own

#include "torsio/live/telemetry_publisher.hpp"
#include "torsio/live/web_server.hpp"
