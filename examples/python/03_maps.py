"""Map a world, save the map, localise in it, and make a cloud, a grid and a mesh."""

import yfslam


def main() -> None:
    world = yfslam.World("walking_xyz?frames=60")
    slam = yfslam.Slam(world.camera, dense=True)
    for frame in world:
        slam.track(frame.frame)
    slam.finish()
    slam.save_map("room.map")
    print(f"{len(slam.landmarks().positions)} landmarks, {len(slam.keyframes().poses)} keyframes")

    again = yfslam.Slam(world.camera, map="room.map", localise=True)
    found = sum(again.track(world[index].frame).is_tracking for index in range(30, 40))
    print(f"{found} of 10 frames localised")

    dense = slam.dense_map()
    cloud, mesh, grid = dense.cloud(), dense.mesh(), dense.grid(-0.5, 0.5)
    print(f"{len(cloud.positions)} points, {len(mesh.triangles)} triangles, grid of {grid.cells.shape} cells")


if __name__ == "__main__":
    main()
