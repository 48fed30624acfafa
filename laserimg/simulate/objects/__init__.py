"""Parametric objects: each call of a maker gives another one."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from laserimg.simulate.objects.bicycles import bicycle
from laserimg.simulate.objects.cars import car
from laserimg.simulate.objects.clutter import bag, cables, equipment, screen, stack, trolley, whiteboard
from laserimg.simulate.objects.desks import desk, pedestal, table
from laserimg.simulate.objects.devices import computer, floor_lamp, monitor, printer, robot
from laserimg.simulate.objects.doors import door
from laserimg.simulate.objects.facades import facade
from laserimg.simulate.objects.fixtures import ceiling_lamp, column, pipe, plant, radiator
from laserimg.simulate.objects.hedges import hedge
from laserimg.simulate.objects.lorries import lorry
from laserimg.simulate.objects.outdoor import (
    bench,
    fence,
    litter_bin,
    low_wall,
    planter,
    shrub,
    utility_box,
    wheelie_bin,
)  # fmt: skip
from laserimg.simulate.objects.people import person
from laserimg.simulate.objects.poles import bollard, lamp_post, sign_post, traffic_light
from laserimg.simulate.objects.seats import armchair, chair, office_chair, stool
from laserimg.simulate.objects.stairs import stairs
from laserimg.simulate.objects.storage import cabinet, cardboard_boxes, coat_rack, shelf, suitcase
from laserimg.simulate.objects.trees import tree
from laserimg.simulate.objects.vessels import bucket, drum, full_wastebasket, umbrella_stand, wastebasket
from laserimg.simulate.objects.windows import glazing, window
from laserimg.simulate.things import Thing

_MAKERS = (
    wastebasket, office_chair, door, window, stairs,
    desk, table, pedestal, chair, stool, armchair, shelf, cabinet, cardboard_boxes, suitcase, coat_rack,
    computer, monitor, printer, floor_lamp, robot, radiator, column, pipe, plant, ceiling_lamp, bucket,
    umbrella_stand, drum, glazing, bag, cables, equipment, screen, stack, trolley, whiteboard,
    full_wastebasket, car, person, tree, lamp_post, sign_post, traffic_light, bollard, hedge, facade,
    lorry, bicycle, bench, litter_bin, wheelie_bin, utility_box, planter, shrub, fence, low_wall,
)  # fmt: skip
OBJECTS: Mapping[str, Callable[[np.random.Generator], Thing]] = MappingProxyType(
    {maker.__name__: maker for maker in _MAKERS}
)
