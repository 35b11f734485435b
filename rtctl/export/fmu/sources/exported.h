/* Functions that a simulator finds in the unit's binary. */
#ifndef EXPORTED_H
#define EXPORTED_H

#if defined _WIN32
#define EXPORT __declspec(dllexport)
#elif defined __GNUC__
#define EXPORT __attribute__((visibility("default")))
#else
#define EXPORT
#endif

#endif
