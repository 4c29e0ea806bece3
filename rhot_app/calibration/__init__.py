"""Calibrations, each collect -> solve -> report: functions of images and observations, without Qt and sockets."""
