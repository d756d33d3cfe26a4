#pragma once

#define PLUGINLIB_EXPORT_CLASS(derived, base) static_assert(sizeof(derived) >= sizeof(base));
