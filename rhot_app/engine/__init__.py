"""The engine process: sources, tracker and log, served to clients."""
