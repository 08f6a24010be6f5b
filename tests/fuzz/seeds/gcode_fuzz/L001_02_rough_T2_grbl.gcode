(Slabwright 0.1.0: L001_02_rough_T2.gcode)
(pattern half-sphere.stl)
(layer 1 of 3, z 0 to 18.5 mm from the pattern's bottom)
(z = 0 at the layer's top)
(rough: contour-parallel levels)
(tool 2: flat end mill 1/2 in, diameter 12.7 mm)
(cutting 16256.7 mm, 3.3 min)
(before the start: tool 2 in the spindle, its tip touched off)
(-11=0.02 at most, laser mode off)
G21 G17 G90 G94 G40 G49 G80
G61
G54
T2
S18000 M3
G4 P3
G0 Z10
X-75.8032 Y-82.25
Z-3.2
G1 Z-3.7 F9000
Y75.8032
X75.8032
Y-75.8032
X-75.8032
X-69.8564
Y69.8564
X69.8564
Y-69.8564
X-69.8564
X-63.9096
Y63.9096
X63.9096
Y-63.9096
X-63.9096
X-57.9628
Y57.9628
X57.9628
Y-57.9628
X-57.9628
X-52.0451 Y-58.4628
G2 X-58.4628 Y-52.0028 I47.9188 J54.0229
G0 Z10
M5
M2
