"""Poses that other trackers measure: SteamVR, libsurvive, programs that print lines, and files."""
