"""The node's sockets: who it is and where, clocks, start and stop, requests and pictures."""
