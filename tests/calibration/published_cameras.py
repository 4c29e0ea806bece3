"""Calibration files that other projects published: numbers only as far as the tests need them, with source and licence.
"""

from __future__ import annotations

OPENCV_PAIR = """%YAML:1.0
M1: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 5.3480326845051309e+02, 0., 3.3568643204394891e+02, 0.,
       5.3480326845051309e+02, 2.4066183054066337e+02, 0., 0., 1. ]
D1: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ 2.9589439552724328e-01, -1.0354662043042675e+00, 0., 0., 0. ]
M2: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 5.3480326845051309e+02, 0., 3.3455744527912015e+02, 0.,
       5.3480326845051309e+02, 2.4205324573376600e+02, 0., 0., 1. ]
D2: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ -1.6916358306948096e-01, -1.1214173641213163e-01, 0., 0., 0. ]
"""
"""opencv/opencv, samples/data/intrinsics.yml, Apache-2.0. The extrinsics beside it are not published."""

OPENCV_CAMERA = """%YAML:1.0
---
nframes: 13
image_width: 640
image_height: 480
board_width: 9
board_height: 6
square_size: 2.5000000372529030e-02
aspectRatio: 1.
flags: 2
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 5.3591573396163199e+02, 0., 3.4228315473308373e+02, 0.,
       5.3591573396163199e+02, 2.3557082909788173e+02, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -2.6637260909660682e-01, -3.8588898922304653e-02,
       1.7831947042852964e-03, -2.8122100441115472e-04,
       2.3839153080878486e-01 ]
avg_reprojection_error: 3.9259098975581364e-01
"""
"""opencv/opencv, samples/data/left_intrinsics.yml, Apache-2.0, without its views."""

ROS_CAMERA = """---
image_width: 640
image_height: 480
camera_name: 08144361026320a0
camera_matrix:
  rows: 3
  cols: 3
  data: [1168.68, 0, 295.015, 0, 1169.01, 252.247, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-1.04482, 1.59252, -0.0196308, 0.0287906, 0]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
projection_matrix:
  rows: 3
  cols: 4
  data: [1168.68, 0, 295.015, 0, 0, 1169.01, 252.247, 0, 0, 0, 1, 0]
"""
"""ros-perception/image_common, camera_info_manager/tests/test_calibration.yaml, BSD-3-Clause."""

def _ros(name: str, **matrices: tuple[int, int, str]) -> str:
    parts = [f"{key}:\n  rows: {rows}\n  cols: {cols}\n  data: [{data}]\n" for key, (rows, cols, data)
             in matrices.items()]
    return (f"image_width: 640\nimage_height: 480\ncamera_name: {name}\ndistortion_model: plumb_bob\n"
            + "".join(parts))


ROS_PAIR = (
    _ros("left", camera_matrix=(3, 3, "430.15433020105519, 0.0, 311.71339830549732, 0.0, 430.60920415473657, "
                                "221.06824942698509, 0.0, 0.0, 1.0"),
         distortion_coefficients=(1, 5, "-0.363528858080088, 0.16117037733986861, -8.1109585007538829e-05, "
                                  "-0.00044776712298447841, 0.0"),
         rectification_matrix=(3, 3, "0.99806560714807102, 0.0068562422224214027, 0.061790256276695904, "
                               "-0.0067522959054715113, 0.99997541519165112, -0.0018909025066874664, "
                               "-0.061801701660692349, 0.0014700186639396652, 0.99808736527268516"),
         projection_matrix=(3, 4, "295.53402059708782, 0.0, 285.55760765075684, 0.0, 0.0, 295.53402059708782, "
                            "223.29617881774902, 0.0, 0.0, 0.0, 1.0, 0.0")),
    _ros("right", camera_matrix=(3, 3, "428.38163131344191, 0.0, 327.95553847249192, 0.0, 428.85728580588329, "
                                 "217.54828640915309, 0.0, 0.0, 1.0"),
         distortion_coefficients=(1, 4, "-0.3560641041112021, 0.15647260261553159, -0.00016442960757099968, "
                                  "-0.00093175810713916221"),
         rectification_matrix=(3, 3, "0.9982082576219119, 0.0067433328293516528, 0.059454199832973849, "
                               "-0.0068433268864187356, 0.99997549128605434, 0.0014784127772287513, "
                               "-0.059442773257581252, -0.0018826283666309878, 0.99822993965212292"),
         projection_matrix=(3, 4, "295.53402059708782, 0.0, 285.55760765075684, -26.507895206214123, 0.0, "
                            "295.53402059708782, 223.29617881774902, 0.0, 0.0, 0.0, 1.0, 0.0")))
"""ros-perception/vision_opencv, image_geometry/test/directed.py, BSD-3-Clause: D, K, R and P "taken from a real camera
calibration", here as files of camera_info."""

KALIBR_CHAIN = """cam0:
  camera_model: pinhole
  intrinsics: [461.629, 460.152, 362.680, 246.049]
  distortion_model: radtan
  distortion_coeffs: [-0.27695497, 0.06712482, 0.00087538, 0.00011556]
  T_cam_imu:
  - [0.01779318, 0.99967549,-0.01822936, 0.07008565]
  - [-0.9998017, 0.01795239, 0.00860714,-0.01771023]
  - [0.00893160, 0.01807260, 0.99979678, 0.00399246]
  - [0.0, 0.0, 0.0, 1.0]
  timeshift_cam_imu: -8.121e-05
  rostopic: /cam0/image_raw
  resolution: [752, 480]
cam1:
  camera_model: omni
  intrinsics: [0.80065662, 833.006, 830.345, 373.850, 253.749]
  distortion_model: radtan
  distortion_coeffs: [-0.33518750, 0.13211436, 0.00055967, 0.00057686]
  T_cn_cnm1:
  - [ 0.99998854, 0.00216014, 0.00427195,-0.11003785]
  - [-0.00221074, 0.99992702, 0.01187697, 0.00045792]
  - [-0.00424598,-0.01188627, 0.99992034,-0.00064487]
  - [0.0, 0.0, 0.0, 1.0]
  T_cam_imu:
  - [ 0.01567142, 0.99978002,-0.01393948,-0.03997419]
  - [-0.99966203, 0.01595569, 0.02052137,-0.01735854]
  - [ 0.02073927, 0.01361317, 0.99969223, 0.00326019]
  - [0.0, 0.0, 0.0, 1.0]
  timeshift_cam_imu: -8.681e-05
  rostopic: /cam1/image_raw
  resolution: [752, 480]
"""
"""ethz-asl/kalibr, the wiki's page "yaml formats", BSD-3-Clause. Both cameras also state where the IMU is."""

KALIBR_PINHOLES = KALIBR_CHAIN.replace("omni", "pinhole").replace("[0.80065662, 833.006", "[833.006")
"""The same with a second camera that RHOT has: the poses stay as they are published."""

ANIPOSE = """[cam_0]
name = "cam088"
size = [ 1440, 1080,]
matrix = [ [ 1852.4059883563652, 0.0, 719.5,], [ 0.0, 1852.4059883563652, 539.5,], [ 0.0, 0.0, 1.0,],]
distortions = [ -0.03617269969805811, 0.0, 0.0, 0.0, 0.0,]
rotation = [ -0.0017222068652836759, -0.0017660019086589327, -0.004590121306089567,]
translation = [ 2.5517119183276713, -2.7696043565510524, -18.17036813575914,]

[cam_1]
name = "cam091"
size = [ 1440, 1080,]
matrix = [ [ 1935.9928441823383, 0.0, 719.5,], [ 0.0, 1935.9928441823383, 539.5,], [ 0.0, 0.0, 1.0,],]
distortions = [ -0.31335387778001184, 0.0, 0.0, 0.0, 0.0,]
rotation = [ -0.22567280935134637, -2.982027267048808, 0.38741210057825076,]
translation = [ 117.3672986155046, 262.4968784063239, 1478.8177605708502,]

[cam_2]
name = "cam581"
size = [ 1440, 1080,]
matrix = [ [ 1772.7800311270119, 0.0, 719.5,], [ 0.0, 1772.7800311270119, 539.5,], [ 0.0, 0.0, 1.0,],]
distortions = [ -0.16089133125720043, 0.0, 0.0, 0.0, 0.0,]
rotation = [ -1.5188504953392132, -1.6527771271718548, 0.232526822863512,]
translation = [ 557.4745554239261, -254.39347644640128, 1177.7226928420612,]

[cam_3]
name = "cam592"
size = [ 1440, 1080,]
matrix = [ [ 1812.2653854315913, 0.0, 719.5,], [ 0.0, 1812.2653854315913, 539.5,], [ 0.0, 0.0, 1.0,],]
distortions = [ -0.06402314642583454, 0.0, 0.0, 0.0, 0.0,]
rotation = [ -1.5851933551187563, 0.09073578783071218, 0.02450788080567816,]
translation = [ -33.44634181320557, -727.3358410375549, 812.0911848796799,]

[metadata]
adjusted = true
error = 1.6680509250648916
"""
"""lambdaloop/aniposelib, tests/data/calib/7cam-allen-mouse/calibration.toml, BSD-2-Clause; four of seven cameras. Its
board's squares are in mm."""

CALISCOPE = """[cameras.0]
port = 0
rotation_count = 0
error = 0.453
exposure = -6
grid_count = 41
ignore = false
size = [1280, 720]
matrix = [[663.0593431853126, 0.0, 656.3154679819962], [0.0, 673.4366407084017, 342.14227273004707], [0.0, 0.0, 1.0]]
distortions = [0.2007946997569199, -0.30031367326002023, -0.004298726280355069, -0.004912236924991117,
               0.15823464674263954]
translation = [0.05666886720753522, 0.0029046886409570417, 0.8981482977014373]
rotation = [1.6491310603072862, -0.3360235850022911, 0.3112420287645499]

[cameras.1]
port = 1
rotation_count = 0
error = 0.569
exposure = -5
grid_count = 38
ignore = false
size = [1280, 720]
matrix = [[649.3897073332046, 0.0, 645.033962238823], [0.0, 650.0695314477532, 388.36851489906155], [0.0, 0.0, 1.0]]
distortions = [0.21712513189057844, -0.3262195870473084, 0.0010979603060660274, -0.003243082018951228,
               0.1861031299202255]
translation = [-0.38882113145810204, -0.14974172121188314, 0.8645479707566123]
rotation = [1.8097430077827876, -0.3665736359363853, 0.2783206731262874]

[cameras.2]
port = 2
rotation_count = 0
error = 0.494
exposure = -6
grid_count = 40
ignore = false
size = [1280, 720]
matrix = [[700.8131246468602, 0.0, 635.0111380322967], [0.0, 702.3797181061516, 375.7518499055771], [0.0, 0.0, 1.0]]
distortions = [0.19468811052182447, -0.29035727568703296, 0.0022982338140618936, 0.0031616302538021697,
               0.16700877556623483]
translation = [-0.24782737043481592, -0.2629240374809059, 0.9998427949788053]
rotation = [1.7256058413565807, 0.08909539322803751, -0.08023550261522364]
"""
"""mprib/caliscope, tests/reference/2d_data/camera_array.toml, BSD-2-Clause."""

CALISCOPE_PIXELS = ((712.5120239257812, 368.0942687988281), (444.5546569824219, 299.8067932128906),
                    (588.0670166015625, 243.85227966308597))
"""The same project's config.toml: one corner of its board, as the three cameras saw it at one moment."""
