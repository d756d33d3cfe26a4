#pragma once

// Start here to show joints in a browser, or to give their telemetry to programs of others. Needs libwebsockets.
//
//   LivePage             a page with what joints do now
//   TelemetryPublisher   telemetry for PlotJuggler and Foxglove
//   WebServer            files from memory and WebSockets, in a thread of its own

#include "torsio/live/live_page.hpp"
#include "torsio/live/telemetry_publisher.hpp"
#include "torsio/live/web_server.hpp"
