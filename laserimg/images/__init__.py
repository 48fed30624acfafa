"""Images of a scan, 8 bit, as OpenCV sees them.

    range           distance, stretched between percentiles: near is dark
    reflectance     the sensor's own values, stretched between percentiles
    normals         n_x, n_y, n_z of the scanner's frame as red, green, blue
    normals_abs     their absolute values
    normals_view    normals towards the scanner, to the right, up, in the frame of each ray's azimuth
    depth_relative  distance less its mean within 0.45 m

Pixels that are not valid are black. A name with .r, .g or .b is one plane: ``normals.r``.
"""

from laserimg.images.kinds import IMAGE_KINDS, check_image_name, make_image, make_images
from laserimg.images.png import write_png
from laserimg.images.square import SquareGrid

__all__ = ["IMAGE_KINDS", "SquareGrid", "check_image_name", "make_image", "make_images", "write_png"]
