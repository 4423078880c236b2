"""Day one: camera, SLAM and RViz; drive, and call save_map.

  ros2 launch mapping.launch.py
  ros2 service call /yfslam/save_map std_srvs/srv/Trigger
"""

import pathlib

from launch import LaunchDescription
from launch.actions import ExecuteProcess
from launch_ros.actions import Node

HERE = pathlib.Path(__file__).parent


def generate_launch_description():
    camera = Node(
        package="realsense2_camera",
        executable="realsense2_camera_node",
        namespace="camera",
        name="camera",
        parameters=[{"align_depth.enable": True, "enable_sync": True}],
    )
    # Not a package of ROS: one program on the PATH.
    slam = ExecuteProcess(cmd=["yfslam-ros2", "--ros-args", "--params-file", str(HERE / "yfslam.yaml")], output="screen")
    rviz = Node(package="rviz2", executable="rviz2", arguments=["-d", str(HERE / "yfslam.rviz")])
    return LaunchDescription([camera, slam, rviz])
