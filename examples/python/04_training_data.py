"""Rendered frames with exact depth, poses, masks and boxes, for training networks."""

import yfslam


def main() -> None:
    for name, about in yfslam.worlds():
        print(f"{name:22} {about}")
    world = yfslam.World("walking_xyz?seed=7&people=2&frames=10&width=320&height=240")
    for frame in world:
        people = (frame.instances > 0).mean()
        names = [yfslam.World.class_names[index] for index in frame.box_classes]
        print(f"{frame.timestamp_ns} ns: {100 * people:.0f} % of the image moves; {names}")


if __name__ == "__main__":
    main()
