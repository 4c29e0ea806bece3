"""How the machine of a node is: power, heat, memory, clock, network. Used by the daemon and by ``rhot-node doctor``."""
