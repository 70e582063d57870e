#!/usr/bin/env python3
"""Opens a map's survey.qgs in QGIS and looks at what it draws, as JSON. Exit status 77: no QGIS.

    open_in_qgis.py MAP_DIR PICTURE.png
"""
import json
import os
import pathlib
import sys

os.environ["QT_QPA_PLATFORM"] = "offscreen"
try:
    from qgis.core import QgsApplication, QgsMapRendererParallelJob, QgsMapSettings, QgsProject
    from qgis.PyQt.QtCore import QSize
    from qgis.PyQt.QtGui import QColor
except ImportError:
    sys.exit(77)

folder, picture = pathlib.Path(sys.argv[1]), sys.argv[2]
QgsApplication.setPrefixPath("/usr", True)
application = QgsApplication([], False)
application.initQgis()
project = QgsProject.instance()
result = {"read": project.read(str(folder / "survey.qgs")), "crs": project.crs().authid(),
          "layers": [], "absolute_paths": []}
nodes = project.layerTreeRoot().findLayers()
for node in nodes:
    layer = node.layer()
    result["layers"].append({"name": node.name(), "visible": node.isVisible(),
                             "valid": layer is not None and layer.isValid(),
                             "crs": layer.crs().authid() if layer else ""})
elevation = next(n.layer() for n in nodes if n.name() == "Elevation")

# Without the track, so that every coloured pixel is seabed.
settings = QgsMapSettings()
settings.setDestinationCrs(project.crs())
settings.setLayers([n.layer() for n in nodes if n.isVisible() and n.name() != "Track"])
settings.setExtent(elevation.extent())
settings.setOutputSize(QSize(300, 300))
settings.setBackgroundColor(QColor(255, 0, 255))
job = QgsMapRendererParallelJob(settings)
job.start()
job.waitForFinished()
image = job.renderedImage()
image.save(picture)

# Colours by depth: the mean of the pixels over the deepest and over the shallowest tenth.
provider, extent = elevation.dataProvider(), elevation.extent()
pixels = []
for y in range(0, 300, 3):
    for x in range(0, 300, 3):
        colour = image.pixelColor(x, y)
        if (colour.red(), colour.green(), colour.blue()) == (255, 0, 255):
            continue
        point = settings.mapToPixel().toMapCoordinates(x, y)
        value, known = provider.sample(point, 1)
        if known:
            pixels.append((value, colour.red(), colour.green(), colour.blue()))
pixels.sort()
tenth = max(1, len(pixels) // 10)


def mean(group):
    return [sum(p[k] for p in group) / len(group) for k in (1, 2, 3)]


result.update(pixels=len(pixels), colours=len({p[1:] for p in pixels}),
              deepest=mean(pixels[:tenth]), shallowest=mean(pixels[-tenth:]))
print(json.dumps(result))
sys.stdout.flush()
os._exit(0)  # QGIS's own end may wait for its threads
