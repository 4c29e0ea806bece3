"""Tracked objects: rigid bodies with fiducial tags or colour markers, and poses that other trackers stream."""
