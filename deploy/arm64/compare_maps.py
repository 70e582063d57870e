#!/usr/bin/env python3
"""compare_maps.py MAP OTHER NAME: which files of two maps of one survey have the same bytes, and by how much the poses
of the submaps differ. Exits with 1 if one differs by more than 0.01 of the smallest 1 sigma that an edge of the graph
states."""
import math
import pathlib
import sys


def graph(folder):
    """Vertices of graph.g2o, id to (x, y, yaw), and the smallest sigmas of its edges, in metres and radians."""
    vertices, sigma_m, sigma_rad = {}, math.inf, math.inf
    for line in (folder / "graph.g2o").read_text().splitlines():
        words = line.split()
        if words[0] == "VERTEX_SE2":
            vertices[int(words[1])] = tuple(float(word) for word in words[2:5])
        elif words[0] == "EDGE_SE2":  # upper triangle of the information: xx, x y, x yaw, yy, y yaw, yaw yaw
            information = [float(word) for word in words[6:12]]
            sigma_m = min(sigma_m, max(information[0], information[3]) ** -0.5)
            sigma_rad = min(sigma_rad, information[5] ** -0.5)
    return vertices, sigma_m, sigma_rad


def main():
    one, other, name = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3]
    files = sorted(path.relative_to(one) for path in one.rglob("*") if path.is_file())
    same = [file for file in files if (other / file).is_file() and (one / file).read_bytes() == (other / file).read_bytes()]
    (ours, sigma_m, sigma_rad), (theirs, _, _) = graph(one), graph(other)
    if ours.keys() != theirs.keys():
        sys.exit(f"arm64: {name}: other submaps")
    distance_m = max(math.hypot(a[0] - theirs[i][0], a[1] - theirs[i][1]) for i, a in ours.items())
    yaw_rad = max(abs(a[2] - theirs[i][2]) for i, a in ours.items())
    submaps = [file for file in files if file.parts[0] == "submaps"]
    print(f"   {name}: {len(same)} of {len(files)} files have the same bytes, {sum(file in same for file in submaps)} of "
          f"{len(submaps)} submaps; poses differ by at most {1e6 * distance_m:.3g} um "
          f"and {1e6 * yaw_rad:.3g} urad, {max(distance_m / sigma_m, yaw_rad / sigma_rad):.2g} of the smallest sigma")
    first = [file.as_posix() for file in files if file not in same]
    print(f"   {name}: other bytes: {', '.join(first) if first else 'none'}")
    if max(distance_m / sigma_m, yaw_rad / sigma_rad) > 0.01:
        sys.exit(f"arm64: {name}: a pose differs by more than 0.01 sigma")


if __name__ == "__main__":
    main()
