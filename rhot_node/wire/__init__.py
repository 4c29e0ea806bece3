"""The wire: what nodes and master say to each other in UDP datagrams, and its bytes. docs/wire.md, byte by byte."""
