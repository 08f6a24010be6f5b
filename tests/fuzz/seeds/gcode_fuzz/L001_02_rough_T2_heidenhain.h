0 BEGIN PGM L001_02_rough_T2 MM
1 ; Slabwright 0.1.0: L001_02_rough_T2.h
2 ; pattern half-sphere.stl
3 ; layer 1 of 3, z 0 to 18.5 mm from the pattern's bottom
4 ; z = 0 at the layer's top
5 ; rough: contour-parallel levels
6 ; tool 2: flat end mill 1/2 in, diameter 12.7 mm
7 ; cutting 16276.6 mm, 3.23 min
8 ; the active preset is the zero that the setup sheet shows
9 TOOL CALL 2 Z S18000
10 CYCL DEF 32.0 TOLERANCE
11 CYCL DEF 32.1 T0.1
12 M3
13 CYCL DEF 9.0 DWELL TIME
14 CYCL DEF 9.1 DWELL 3
15 L Z+10 R0 FMAX
16 L X-75.8032 Y-82.25 FMAX
17 L Z-3.2 FMAX
18 L Z-3.7 F9000
19 L Y+75.8032
20 L X+75.8032
21 L Y-75.8032
22 L X-75.8032
23 L X-69.8564
24 L Y+69.8564
25 L X+69.8564
26 L Y-69.8564
27 L X-69.8564
28 L X-63.9096
29 L Y+63.9096
30 L X+63.9096
31 L Y-63.9096
32 L X-63.9096
33 L X-57.9628
34 L Y+57.9628
35 L X+57.9628
36 L Y-57.9628
37 L X-57.9628
38 L X-51.9845 Y-58.4628
39 L X-56.0822 Y-54.6459
40 M5
41 M30
42 END PGM L001_02_rough_T2 MM
