"""Live streams to other programs: OSC, VMC, JSON over WebSocket, LSL, Zenoh, plug-ins, and the web view."""
