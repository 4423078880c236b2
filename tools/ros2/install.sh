#!/usr/bin/env bash
# Installs a real ROS 2 (Kilted, Fast DDS) and Cyclone DDS from PyPI into a virtual environment: about 300 MB. Needs Python 3.11.
#   tools/ros2/install.sh target/ros2-venv
set -euo pipefail
venv=${1:?give the folder of the virtual environment, such as target/ros2-venv}
python3.11 -m venv "$venv"
"$venv/bin/pip" install --quiet ros-kilted-rclpy ros-kilted-rmw-fastrtps-cpp ros-kilted-sensor-msgs ros-kilted-nav-msgs \
    ros-kilted-geometry-msgs ros-kilted-diagnostic-msgs ros-kilted-std-srvs ros-kilted-visualization-msgs ros-kilted-rosgraph-msgs \
    ros-kilted-rcl-interfaces cyclonedds numpy pillow
"$venv/bin/python" -c 'import rclpy; rclpy.init(); print("ROS 2 with", rclpy.get_rmw_implementation_identifier()); rclpy.shutdown()'
