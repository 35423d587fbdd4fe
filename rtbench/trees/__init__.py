"""K-d trees and a bounding volume hierarchy over triangles: how they are built and walked."""
