"""Logs as bytes: mcap files, ROS 1 bags and rosbag2 directories.

================  =================================================================
stored_log        opens a log, however it is stored
mcap_file         reads mcap files from front to back, whole or not
mcap_parsing      the records that these are made of, many at a time
ros1_bag          reads ROS 1 bags from front to back, whole or not
db3_file          reads db3 files, of every version of their schema
decompression     unpacks no more than is declared
message_batches   messages as bytes, many at a time
message_layout    where in these bytes the numbers lie
byte_arrays       what is done with the bytes of every message, many at a time
log_metadata      what the metadata of a rosbag2 directory say
message_template  a serialised message whose numbers change in place
topic             what a log says of a topic
log_writer        writes rosbag2 directories
mcap_storage      the mcap file in these: with checksums, readable whenever it ends
================  =================================================================
"""
