"""Terms used by testing machines, in five languages; all in lower case."""

from __future__ import annotations

NAMES: dict[str, tuple[str, ...]] = {
    "displacement_mm": (
        *("extension", "displacement", "deflection", "flexure extension", "flexural extension"),
        *("compressive extension", "flexural displacement", "compressive displacement"),
        *("stroke", "crosshead", "crosshead displacement", "axial displacement", "position"),
        *("standardweg", "durchbiegung", "verformung", "traversenweg", "weg"),
        *("flèche", "déplacement", "deplacement", "course", "déplacement traverse"),
        *("flecha", "desplazamiento", "deflexión", "recorrido", "carrera", "extensión"),
        *("挠度", "位移", "变形", "行程", "横梁位移"),
    ),
    "force_N": (
        *("load", "force", "flexure load", "flexural load", "compressive load", "axial force"),
        *("flexural force", "compressive force", "standard force", "test force"),
        *("standardkraft", "prüfkraft", "biegekraft", "kraft", "last"),
        *("effort", "charge", "fuerza", "carga", "试验力", "载荷", "负荷", "荷载", "力"),
    ),
    "time_s": (
        *("time", "total time", "test time", "running time", "elapsed time"),
        *("prüfzeit", "zeit", "temps", "tiempo", "时间"),
    ),
}
"""Names of columns by quantity; the first that occurs in a file is taken."""

UNIT_SPELLINGS = {
    **{"sec": "s", "seconds": "s", "sekunden": "s", "秒": "s"},
    **{"inch": "in", "newton": "N", "n": "N", "牛": "N", "kn": "kN", "毫米": "mm", "µm": "um"},
}
"""Other spellings of units."""

DIAMETERS = ("diameter", "durchmesser", "diamètre", "diametre", "diámetro", "diametro", "直径")
"""Parts of a header's key that stand for the diameter of a specimen."""

SPANS = (
    *("span", "stützweite", "auflagerabstand", "portée", "entraxe", "distancia entre apoyos"),
    *("luz", "跨距", "跨度"),
)
"""Parts of a header's key that stand for the distance between the supports."""
