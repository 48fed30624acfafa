"""`laserimg truth`: labels of public data sets as COCO boxes on the grids of their scans."""

from pathlib import Path
from typing import Annotated

import typer


def truth(
    paths: Annotated[list[Path], typer.Argument(help="Scan files, folders or globs, labels beside them.")],
    out: Annotated[Path, typer.Option("-o", "--out", help="COCO file to write.")],
    min_points: Annotated[int, typer.Option(min=1, help="Objects with fewer returns are to be ignored.")] = 1,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Write the 3D boxes that KITTI, SUSTech POINTS and Argoverse 2 keep beside their scans as truth.

    A box is the bounding rectangle of the pixels whose points lie in the 3D box, and its area their number.
    Other vehicles, riders, and what lies outside the labelled view have iscrowd 1: neither hits nor misses.

    \b
      laserimg truth kitti/training/velodyne -o truth.coco.json
      laserimg truth sustech/example/lidar --min-points 200 -o truth.coco.json
      laserimg detect sustech/example/lidar -o out && laserimg evaluate out/detections.json truth.coco.json
    """
    from laserimg.batch import common_folder
    from laserimg.cli.progress import track
    from laserimg.errors import LaserImgError
    from laserimg.formats.boxes3d import labels_beside
    from laserimg.formats.coco import Annotation, CocoFile, CocoImage
    from laserimg.formats.coco_file import write_coco
    from laserimg.readers import find_files, read_file
    from laserimg.truth import CATEGORIES, truth_of

    files = find_files(paths)
    folder = common_folder(files)
    images: list[CocoImage] = []
    boxes: list[Annotation] = []
    errors = []
    for file in track(files, len(files), "scans", quiet):
        try:
            labels = labels_beside(file)
            for scan in read_file(file):
                height, width = scan.shape
                name = file.absolute().relative_to(folder).as_posix()
                images.append(CocoImage(len(images) + 1, name, width, height, scan.index))
                boxes += truth_of(scan, labels, images[-1], len(boxes) + 1, min_points)
        except LaserImgError as error:
            errors.append(str(error))
    if images:
        write_coco(out, CocoFile(tuple(images), CATEGORIES, tuple(boxes)))
    if images and not quiet:
        asked = sum(not box.iscrowd for box in boxes)
        counts = f"{len(images)} scans, {asked} objects, {len(boxes) - asked} boxes to ignore"
        typer.echo(f"{counts}; written to {out}")
    for line in errors:
        typer.echo(f"laserimg: {line}", err=True)
    if errors:
        raise typer.Exit(1)
