"""The 3-D mouse (Rehg 1995, 4.3.4): a hand moves a cursor over a ground plane; thumb and little finger click."""
