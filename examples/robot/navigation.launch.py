"""Day two: the camera is localised in the map of yesterday, and nav2 drives.

  ros2 launch navigation.launch.py map:=/var/lib/yfslam/lab.map

nav2 takes the live grid from the topic map, so that neither map_server nor amcl is started.
"""

import pathlib

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
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
    slam = ExecuteProcess(
        cmd=["yfslam-ros2", "--ros-args", "--params-file", str(HERE / "yfslam.yaml"), "-p", ["load_map:=", LaunchConfiguration("map")]],
        output="screen",
    )
    nav2 = pathlib.Path(get_package_share_directory("nav2_bringup")) / "launch" / "navigation_launch.py"
    return LaunchDescription(
        [
            DeclareLaunchArgument("map", default_value="/var/lib/yfslam/lab.map"),
            camera,
            slam,
            IncludeLaunchDescription(PythonLaunchDescriptionSource(str(nav2)), launch_arguments={"use_sim_time": "false"}.items()),
        ]
    )
