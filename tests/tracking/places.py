"""Where an estimated hand has its markers, for tests of what takes them from there."""

from rhot_app.tracking.kalman.estimate import Estimate
from rhot_app.tracking.kalman.markers import Places, Worn, empty_places, place_markers


def places_of(worn: Worn, estimate: Estimate) -> Places:
    """As `place_markers` has them."""
    places = empty_places(worn.dh)
    place_markers(worn.dh, estimate, places)
    return places
