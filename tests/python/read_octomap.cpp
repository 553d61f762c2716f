// Prints what an OctoMap file knows of the cells of a raster at half a cell's height, row by row
// from the lowest y: 1 occupied, 0 free, -1 unknown.
#include <octomap/OcTree.h>

#include <cstdio>
#include <cstdlib>

int main(int argc, char **argv)
{
    if (argc != 7) {
        return 2;
    }
    octomap::OcTree tree(argv[1]);
    const double x0_m = std::atof(argv[2]), y0_m = std::atof(argv[3]), cell_m = std::atof(argv[4]);
    if (tree.getResolution() != cell_m) {
        return 1;
    }
    for (int iy = 0; iy < std::atoi(argv[6]); ++iy) {
        for (int ix = 0; ix < std::atoi(argv[5]); ++ix) {
            const octomap::OcTreeNode *const node =
                tree.search(x0_m + (ix + 0.5) * cell_m, y0_m + (iy + 0.5) * cell_m, 0.5 * cell_m);
            std::printf("%d\n", node == nullptr ? -1 : tree.isNodeOccupied(node) ? 1 : 0);
        }
    }
    return 0;
}
