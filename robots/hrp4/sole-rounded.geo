// A sole for HRP-4's left foot with rounded corners: 0.23 x 0.13 x 0.021 m, radius 0.025 m. Symmetric, so it is the right one's, too.
// gmsh -3 -format msh41 sole-rounded.geo -o sole-rounded.msh      (version 4.15.2 made the file that ships)
SetFactory("OpenCASCADE");
Rectangle(1) = {-0.115, -0.065, 0, 0.23, 0.13, 0.025};
Extrude {0, 0, 0.021} { Surface{1}; }
Physical Surface("contact") = {1};
Physical Surface("clamped") = {10};
Physical Volume("sole") = {1};
Mesh.MeshSizeMin = 0.014;
Mesh.MeshSizeMax = 0.014;
