# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface in German. Blender's own words are those of its German translation."""

from __future__ import annotations

from collections.abc import Mapping

LABELS: Mapping[str, str] = {
    "Adaptive": "Adaptiv",
    "Advanced": "Erweitert",
    "All Light": "Alles Licht",
    "All Objects": "Alle Objekte",
    "All Shadow Boundaries": "Alle Schattengrenzen",
    "Antumbra": "Antumbra",
    "Antumbra Preset": "Antumbra-Vorgabe",
    "Antumbra Radiosity": "Antumbra Radiosity",
    "Automatic": "Automatisch",
    "Bake": "Backen",
    "Bake Radiosity": "Radiosity backen",
    "Before the Bake": "Vor dem Backen",
    "Best": "Beste",
    "Black": "Schwarz",
    "Blocker Only": "Nur Schatten",
    "Byte": "Byte",
    "Cancel Bake": "Backen abbrechen",
    "Check Scene": "Szene prüfen",
    "Colour Steps": "Farbstufen",
    "Contact": "Berührung",
    "Custom": "Eigene",
    "Data Type": "Datentyp",
    "Direct and Indirect Too": "Auch direkt und indirekt",
    "Domain": "Domäne",
    "Draft": "Entwurf",
    "Element Size": "Elementgröße",
    "Elements": "Elemente",
    "Encoding": "Kodierung",
    "Error": "Fehler",
    "Error Curve": "Fehlerkurve",
    "Excluded": "Ausgeschlossen",
    "Export": "Exportieren",
    "Exposed": "Belichtet",
    "Exposure": "Belichtung",
    "Face Corner": "Flächenecke",
    "False Colours": "Falschfarben",
    "Float": "Gleitkomma",
    "For sRGB Vertex Colours": "Für sRGB-Vertexfarben",
    "Game": "Spiel",
    "Good": "Gut",
    "Hierarchical": "Hierarchisch",
    "Layers": "Ebenen",
    "Light Only": "Nur Licht",
    "Light and Colour": "Licht und Farbe",
    "Linear": "Linear",
    "Live Preview": "Live-Vorschau",
    "Make Export-Ready": "Für Export vorbereiten",
    "Matte": "Matt",
    "Max Blockers": "Höchstens Schattenwerfer",
    "Max Level": "Höchste Stufe",
    "Max Triangles": "Höchstens Dreiecke",
    "Metals": "Metalle",
    "Method": "Methode",
    "New Objects": "Neue Objekte",
    "None": "Keine",
    "Normal": "Normal",
    "Nothing stands in the way": "Nichts steht im Weg",
    "Output": "Ausgabe",
    "Overlay": "Einblendung",
    "Part": "Rolle",
    "Penumbra": "Halbschatten",
    "Preset": "Vorgabe",
    "Quality": "Qualität",
    "Quantity": "Größe",
    "Range": "Bereich",
    "Rays": "Strahlen",
    "Receiver Only": "Nur Empfänger",
    "Remove Bake": "Bake entfernen",
    "Replace Meshes": "Meshes ersetzen",
    "Retro": "Retro",
    "Select": "Auswählen",
    "Selected Objects": "Ausgewählte Objekte",
    "Shadow Boundaries": "Schattengrenzen",
    "Shadow Lines": "Schattenlinien",
    "Sharp shadow": "Scharfer Schatten",
    "Shooting": "Schießen",
    "Show": "Zeigen",
    "Show Report": "Bericht zeigen",
    "Show in Viewport": "Im Ansichtsfenster zeigen",
    "Stop and Keep": "Beenden und behalten",
    "Stored Light": "Gespeichertes Licht",
    "Then File > Export > glTF": "Dann Datei > Exportieren > glTF",
    "Time Limit": "Zeitgrenze",
    "Tolerance": "Toleranz",
    "Transport": "Transport",
    "Uniform": "Gleichmäßig",
    "Verify Points": "Prüfpunkte",
    "Vertex": "Vertex",
    "View": "Ansicht",
    "Waiting": "Wartet",
    "sRGB": "sRGB",
    # Of the error curve
    "The last bake told no error": "Der letzte Bake nennt keinen Fehler",
    "seconds": "Sekunden",
    "verified error": "geprüfter Fehler",
    "the solver's own estimate": "eigene Schätzung des Lösers",
}

PROGRESS: Mapping[str, str] = {
    "Ending": "Wird beendet",
    "reading the scene": "liest die Szene",
    "preparing": "bereitet vor",
    "linking surfaces": "verbindet Flächen",
    "finding shadow boundaries": "sucht Schattengrenzen",
    "shooting light": "verteilt Licht",
    "welding": "fügt zusammen",
    "verifying": "prüft",
    "done": "fertig",
    "{} s left": "noch {} s",
    "{} min left": "noch {} min",
    "Switch back to the scene to read it": "Zum Lesen zurück zur Szene wechseln",
    "To read the scene, switch to Object Mode": "Zum Lesen in den Objektmodus wechseln",
    "To read the scene, wait for the render": "Liest die Szene nach dem Rendern",
    "To read the scene, finish the current action": "Zum Lesen die laufende Aktion beenden",
    "Light is ready: switch back to its scene": "Licht ist fertig: zurück zur Szene wechseln",
    "Light is ready: switch to Object Mode": "Licht ist fertig: in den Objektmodus wechseln",
    "Light is ready: wait for the render": "Licht ist fertig: wartet auf das Rendern",
    "Light is ready: finish the current action": "Licht ist fertig: laufende Aktion beenden",
    # Before and after
    "{} to {}": "{} bis {}",
    "{} more in the report": "{} weitere im Bericht",
    "{} triangles": "{} Dreiecke",
    "Up to {} of memory": "Bis zu {} Speicher",
    "{} triangles in {} s": "{} Dreiecke in {} s",
    "verified error {} % ({} to {})": "geprüfter Fehler {} % ({} bis {})",
    "verified error below {} %": "geprüfter Fehler unter {} %",
    "{}, estimated {} %": "{}, geschätzt {} %",
    "estimated error {} %": "geschätzter Fehler {} %",
    "Baked {}": "Gebacken: {}",
    "Cancelled; nothing was changed": "Abgebrochen; nichts wurde geändert",
    "The bake failed; the system console has the details": "Das Backen schlug fehl; Näheres in der Systemkonsole",
    "The scene was deleted while its light was computed": "Die Szene wurde gelöscht, während ihr Licht berechnet wurde",
}

TOOLTIPS: Mapping[str, str] = {
    # Operators
    "Compute the light on the chosen objects, refine their meshes where it changes, and store it as vertex colours": (
        "Das Licht auf den gewählten Objekten berechnen, ihre Meshes verfeinern, wo es sich ändert, und es als "
        "Vertexfarben speichern"
    ),
    "Write the light that was computed into the scene": "Das berechnete Licht in die Szene schreiben",
    "Stop refining and keep the light found so far": "Nicht weiter verfeinern und das bisherige Licht behalten",
    "Cancel the bake and change nothing": "Das Backen abbrechen und nichts ändern",
    "Give every bake an unlit material that shows its light from 0 to 1, which glTF exports right": (
        "Jedem Bake ein unbeleuchtetes Material geben, das sein Licht von 0 bis 1 zeigt und das glTF richtig exportiert"
    ),
    "As glTF wants vertex colours: three.js, Unity, Godot's Forward+ and most others": (
        "Wie glTF Vertexfarben vorschreibt: three.js, Unity, Godots Forward+ und die meisten anderen"
    ),
    "For programs that show vertex colours as they are stored, as Godot's Compatibility does": (
        "Für Programme, die Vertexfarben zeigen, wie sie gespeichert sind, etwa Godots Compatibility"
    ),
    "List what would go wrong in a bake, and estimate its triangles, time and memory. Nothing is changed": (
        "Auflisten, was beim Backen schiefginge, und Dreiecke, Zeit und Speicher schätzen. Nichts wird geändert"
    ),
    "Select the objects that this is about": "Die Objekte auswählen, um die es geht",
    "Set tolerance, triangle budget and the way colours are stored": (
        "Toleranz, Zahl der Dreiecke und Art der Farben einstellen"
    ),
    "Delete the baked objects of this scene and bring the originals back as they were": (
        "Die gebackenen Objekte dieser Szene löschen und die Originale zurückbringen, wie sie waren"
    ),
    "Set the 3D viewports of this window to Solid shading with flat attribute colours: baked light as it is": (
        "Die 3D-Ansichten dieses Fensters auf Solid mit flachen Attributfarben stellen: gebackenes Licht, wie es ist"
    ),
    "Show how the last bake went, and how far it is off, in the web browser": (
        "Im Browser zeigen, wie der letzte Bake verlief und wie genau er ist"
    ),
    # Presets
    "See within seconds where light and shadow fall: 5 % error wanted": (
        "In Sekunden sehen, wohin Licht und Schatten fallen: gewünschter Fehler 5 %"
    ),
    "What most pictures need: 1 % error wanted": "Was die meisten Bilder brauchen: gewünschter Fehler 1 %",
    "Smooth also where one looks closely: 0.3 % error wanted, several times the time": (
        "Auch aus der Nähe glatt: gewünschter Fehler 0,3 %, mehrfache Zeit"
    ),
    "At most 20,000 triangles in all baked meshes, and 4 bytes of light for each vertex. Colours end at 1": (
        "Höchstens 20.000 Dreiecke in allen gebackenen Meshes und 4 Byte Licht je Vertex. Farben enden bei 1"
    ),
    "At most 3,000 triangles, 4 bytes of light for each vertex, in 32 steps a channel as consoles of the nineties had "
    "them": "Höchstens 3.000 Dreiecke, 4 Byte Licht je Vertex, in 32 Stufen je Kanal wie auf Konsolen der Neunziger",
    # Settings
    "Which objects get baked. All objects that are visible in renders cast shadows and reflect light": (
        "Welche Objekte gebacken werden. Alle, die im Rendern sichtbar sind, werfen Schatten und reflektieren Licht"
    ),
    "Bake the selected mesh objects": "Die ausgewählten Mesh-Objekte backen",
    "Bake every mesh object that is visible in renders": "Jedes Mesh-Objekt backen, das im Rendern sichtbar ist",
    "Where the refined meshes go": "Wohin die verfeinerten Meshes kommen",
    'Make new objects in the collection "Antumbra" and hide the originals': (
        "Neue Objekte in der Sammlung „Antumbra“ anlegen und die Originale ausblenden"
    ),
    "Give the objects the refined meshes; Remove Bake brings theirs back": (
        "Den Objekten die verfeinerten Meshes geben; „Bake entfernen“ bringt ihre eigenen zurück"
    ),
    "What the colour attribute holds": "Was das Farbattribut enthält",
    "What the surface sends out, its emission included": "Was die Fläche abgibt, samt ihrer Emission",
    "What a white surface would send out: for use over textures": (
        "Was eine weiße Fläche abgäbe: zur Verwendung über Texturen"
    ),
    "What becomes of metals, which reflect no diffuse light": (
        "Was aus Metallen wird, die kein diffuses Licht reflektieren"
    ),
    "A metal reflects its base colour like paint": "Ein Metall reflektiert seine Grundfarbe wie Lack",
    "A metal reflects no diffuse light, as in the diffuse pass of Cycles": (
        "Ein Metall reflektiert kein diffuses Licht, wie im Diffus-Pass von Cycles"
    ),
    "Which colour attributes are written": "Welche Farbattribute geschrieben werden",
    "One colour attribute with all light": "Ein Farbattribut mit allem Licht",
    "Two more colour attributes, whose sum is the first: light from emitters, and light that surfaces reflected before": (
        "Zwei weitere Farbattribute, deren Summe das erste ist: Licht von Lichtquellen, und Licht, das Flächen schon "
        "reflektiert haben"
    ),
    "How colours are stored": "Wie Farben gespeichert werden",
    "As exact and as bright as they are": "So genau und so hell, wie sie sind",
    "In a quarter of the memory: 8 bits a channel with the steps of sRGB, and brighter than 1 becomes 1": (
        "In einem Viertel des Speichers: 8 Bit je Kanal in den Stufen von sRGB; was heller als 1 ist, wird 1"
    ),
    "Where colours are stored": "Wo Farben gespeichert werden",
    "One for each corner of each face: light may jump at edges and contacts": (
        "Eine je Ecke jeder Fläche: Licht darf an Kanten und Berührungen springen"
    ),
    "One for each vertex, the mean of its corners: for programs that know no others. Light runs across sharp edges and "
    "under what touches a surface": (
        "Eine je Vertex, das Mittel seiner Ecken: für Programme, die nichts anderes kennen. Licht läuft über scharfe "
        "Kanten und unter das, was eine Fläche berührt"
    ),
    "Round each channel to this many steps as the eye sees them; brighter than 1 becomes 1. 0 keeps colours smooth": (
        "Jeden Kanal auf so viele Stufen runden, wie das Auge sie sieht; was heller als 1 ist, wird 1. 0 lässt Farben "
        "glatt"
    ),
    "How the mesh is refined": "Wie das Mesh verfeinert wird",
    "Cut faces along the shadow boundaries that can be noticed, then refine them where the light changes: sharp shadows "
    "from few triangles": (
        "Flächen entlang der Schattengrenzen schneiden, die man bemerkt, und dann verfeinern, wo sich das Licht ändert: "
        "scharfe Schatten aus wenigen Dreiecken"
    ),
    "Cut faces along every shadow boundary of every light and every lit surface, noticeable or not: for comparison, "
    "with many more triangles": (
        "Flächen entlang jeder Schattengrenze jedes Lichts und jeder beleuchteten Fläche schneiden, bemerkbar oder nicht: "
        "zum Vergleich, mit viel mehr Dreiecken"
    ),
    "Subdivide faces where the light on them changes: regular triangles, and many of them at sharp shadows": (
        "Flächen unterteilen, wo sich das Licht auf ihnen ändert: regelmäßige Dreiecke, viele davon an scharfen Schatten"
    ),
    "Cut every face to the same size: predictable, but wasteful": (
        "Alle Flächen auf dieselbe Größe schneiden: vorhersehbar, aber verschwenderisch"
    ),
    "Wanted error of the light, as a share of the scene's mean light: 0.01 is 1 %. Half of it takes about twice the "
    "triangles and the time": (
        "Gewünschter Fehler des Lichts als Anteil des mittleren Lichts der Szene: 0,01 ist 1 %. Die Hälfte braucht etwa "
        "doppelt so viele Dreiecke und doppelt so lange"
    ),
    "Longest edge before the light refines anything, in metres. 0 chooses it from the scene": (
        "Längste Kante, bevor das Licht etwas verfeinert, in Metern. 0 wählt sie nach der Szene"
    ),
    "How many times a face may be halved where the light changes. One more makes four times the triangles there": (
        "Wie oft eine Fläche halbiert werden darf, wo sich das Licht ändert. Einmal mehr gibt dort viermal so viele "
        "Dreiecke"
    ),
    "A piece of surface with more shadow casters than this towards one light is subdivided before its shadow boundaries "
    "are drawn": (
        "Ein Stück Fläche mit mehr Schattenwerfern als hier zu einem Licht hin wird unterteilt, bevor seine "
        "Schattengrenzen gezogen werden"
    ),
    "Finish with the light found so far after this many seconds. 0 sets no limit": (
        "Nach so vielen Sekunden mit dem bisherigen Licht enden. 0 setzt keine Grenze"
    ),
    "Stop refining at this many triangles in all baked meshes. 0 leaves the limit to the solver": (
        "Bei so vielen Dreiecken in allen gebackenen Meshes nicht weiter verfeinern. 0 überlässt die Grenze dem Löser"
    ),
    "At how many random points the result is compared with light along random paths, at most, to tell its error. More "
    "take longer; 0 tells none": (
        "An wie vielen zufälligen Punkten das Ergebnis höchstens mit Licht entlang zufälliger Wege verglichen wird, um "
        "seinen Fehler zu nennen. Mehr dauern länger; 0 nennt keinen"
    ),
    "How surfaces exchange light": "Wie Flächen Licht austauschen",
    "Choose from the size of the scene; the report says which it was": (
        "Nach der Größe der Szene wählen; der Bericht nennt die Wahl"
    ),
    "Link surfaces as coarsely as the tolerance allows and solve for all bounces at once: also for nearly white rooms": (
        "Flächen so grob verbinden, wie die Toleranz erlaubt, und alle Reflexionen auf einmal lösen: auch für fast weiße "
        "Räume"
    ),
    "Let every surface look around along rays: for scenes of very many faces": (
        "Jede Fläche entlang von Strahlen umherblicken lassen: für Szenen mit sehr vielen Flächen"
    ),
    "Let one patch after the other shoot its light": "Eine Fläche nach der anderen ihr Licht abgeben lassen",
    # Objects
    "What this object does in an Antumbra bake": "Was dieses Objekt beim Backen mit Antumbra tut",
    "Blocks and reflects light, and is baked when it is chosen": (
        "Hält Licht auf und reflektiert es, und wird gebacken, wenn es gewählt ist"
    ),
    "Takes no part: as if it were not there": "Nimmt nicht teil: als wäre es nicht da",
    "Casts shadows, but reflects and emits nothing and is never baked": (
        "Wirft Schatten, aber reflektiert und sendet nichts und wird nie gebacken"
    ),
    "Is baked when it is chosen, but neither casts shadows nor lights others": (
        "Wird gebacken, wenn es gewählt ist, wirft aber keine Schatten und beleuchtet nichts"
    ),
    # View
    "What the viewport shows of baked light where it shows attributes: Solid shading, Attribute colour": (
        "Was die Ansicht vom gebackenen Licht zeigt, wo sie Attribute zeigt: Shading Solid, Farbe Attribut"
    ),
    "The light as it is stored; brighter than 1 looks like 1": (
        "Das Licht, wie es gespeichert ist; heller als 1 sieht aus wie 1"
    ),
    "The light times a preview exposure, for rooms that are too dark or too bright": (
        "Das Licht mal einer Belichtung für die Vorschau, für zu dunkle oder zu helle Räume"
    ),
    "Illuminance in lux, or luminance in cd/m², with a legend": (
        "Beleuchtungsstärke in Lux oder Leuchtdichte in cd/m², mit Legende"
    ),
    "How far the light is off by the solver's own estimate, in % of its mean, with a legend": (
        "Wie weit das Licht nach eigener Schätzung des Lösers daneben liegt, in % seines Mittels, mit Legende"
    ),
    "Stops by which the preview is brighter: each doubles the light. The stored light stays as it is": (
        "Blendenstufen, um die die Vorschau heller ist: jede verdoppelt das Licht. Das gespeicherte Licht bleibt, wie es "
        "ist"
    ),
    "Light that has the last of the false colours, in lx or cd/m². 0 chooses it from the light": (
        "Licht, das die letzte der Falschfarben hat, in lx oder cd/m². 0 wählt es nach dem Licht"
    ),
    "What is drawn over baked meshes in the viewport": "Was in der Ansicht über gebackene Meshes gezeichnet wird",
    "Nothing": "Nichts",
    "The edges that lie on shadow boundaries and contacts, each kind in its colour": (
        "Die Kanten auf Schattengrenzen und Berührungen, jede Art in ihrer Farbe"
    ),
    "Every edge of the mesh, those on lines in their colours": ("Jede Kante des Meshs, die auf Linien in deren Farben"),
    "While a bake runs, draw its mesh and light over the originals in the viewport after each stage": (
        "Während des Backens nach jeder Stufe Mesh und Licht in der Ansicht über die Originale zeichnen"
    ),
    "Draw into the viewport's corner how the error of the last bake fell with the seconds that it took": (
        "In die Ecke der Ansicht zeichnen, wie der Fehler des letzten Bakes mit den Sekunden fiel"
    ),
}

TEXTS: Mapping[str, str] = {**LABELS, **PROGRESS, **TOOLTIPS}
