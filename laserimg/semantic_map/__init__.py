"""The semantic map of paper 1: ground, clusters and the class of each, of one or several scans."""

from laserimg.semantic_map.maps import MappedScan, ScanMap, SemanticMap, map_scan
from laserimg.semantic_map.models import MapModels

__all__ = ["MapModels", "MappedScan", "ScanMap", "SemanticMap", "map_scan"]
