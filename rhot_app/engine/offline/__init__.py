"""What works on logs and on a running engine from outside: replay at once, and the report on a fault."""
