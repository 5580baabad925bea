"""The ray tracing pipeline of DirectX Raytracing, with its five kinds of shaders, in Python."""
