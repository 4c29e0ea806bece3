"""The camera node: finds colour markers in a camera's images and streams their positions over UDP.

Runs on a Raspberry Pi. It knows pixels, colours and time, and nothing of lenses, metres or hands.
"""

from rhot_node.compiled import use_own_cache

use_own_cache()
