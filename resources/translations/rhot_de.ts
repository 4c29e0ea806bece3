<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="de" sourcelanguage="en">
<context>
    <name></name>
    <message>
        <source>of joints</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Of the hand&apos;s inner joints; the estimator estimates them.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>of fingertips</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Of the fingertips; the estimator estimates them.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>of markers</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Of the markers, as far as they are not the fingertips drawn already.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Start</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Stop</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Record</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Stop recording</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Tell the nodes to stream, or to stop.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Write the raw log of all datagrams, or end it.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Bookmark</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Write a few words about this moment into the recording.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Record video, too</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Each camera writes its own frames as long as the next recording lasts. Rig, Recordings fetches them afterwards.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Simulated rig</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Start two simulated cameras that look at a simulated hand.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Simulated hand does</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cover a simulated camera</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Open rig file …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Open a rig that was set up before.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cameras of this computer …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Choose webcams, films or network cameras, look at them, and track with them.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Connect nodes …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Enter the addresses of two nodes, see whether they answer, and write a rig file for them.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Export recording …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Write a recording&apos;s hand as a file for other programs: tables, motion capture, animation.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Open recording …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Track a recording and play it, in a window of its own.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Recordings …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>All recordings: how long and how well tracked; open, rename, delete.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Track films …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Track a bare hand in films that you have already, and replay it beside their pictures.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Outputs …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Live streams to other programs: OSC, VMC, WebSocket, web view and others; which run, and how they go.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>3-D mouse …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Work a cursor in three dimensions with the hand: pick balls, move them, and take a target test.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Add a tracked object …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Track an object with tags or colour markers beside the hand: choose its object file.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Remove a tracked object</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Save rig</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Write the rig as it is now to its file; what stood there is kept beside it.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Close rig</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>End what the app started and go back to the first page.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Settings …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Look, folders, what opens at the start, and keys.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Quit</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>End what the app started and close it.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>What to do next …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Say what you have, and see the steps that are missing.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Fit the hand to pictures …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Drag joints in the cameras&apos; pictures, move sliders, and let edges finish it: the hand&apos;s lengths and pose.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Bring back an earlier calibration …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Every calibration keeps what it replaced; choose one by date and reason.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Tracker …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Which tracker makes a hand of the markers, and what it may assume.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Hand networks …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Install the networks that find landmarks of a bare hand on this computer.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cameras …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Lenses and positions that the rig file says.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Markers …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The marker set that the rig file says.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Hand …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The hand&apos;s bones that the rig file says.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Properties</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>What the rig file says, to read.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>How to calibrate</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Opens the guide.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Frame the hand</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Bring the hand into the middle of the scene.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Reset the view</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Back to the view from behind the cameras.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Marker names</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Names beside the markers in the scene.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Hand as of now</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Draw the hand where it is when you see it, not where it was in the newest pictures, 10 to 40 ms before. The estimator predicts it.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Uncertainty</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>How well places are known, as ellipsoids: the true place lies inside in 97 of 100 cases (three sigma).</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Ellipsoids in true size.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Ellipsoids {larger} times as large, because a good place is known to a millimetre.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Layers of the hand …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Which link of the tracked hand hides which before a camera, as masks over its picture.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Scene alone</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Hide every panel, to look from afar; again brings them back.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Dark</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Light text on dark ground.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Light</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Dark text on light ground.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Reset layout and settings</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Forget layout, last rig and switches.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Guide</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The page of the guide that explains the panel in use.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Keys</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The guide&apos;s page about keys.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>About RHOT …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Versions for a report of a fault, and licences.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Main</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Controls</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Rig</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Calibrate</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>View</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Help</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>rig: {name} (edited)</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>rig: {name}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The engine&apos;s rig differs from this file; Rig, Save rig writes it.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Attaching to the running engine …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Opening the rig …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Starting the simulated rig …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cancelling …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Closing the rig …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The engine stopped. Starting it again …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Getting started</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The window</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Nodes</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Markers</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cameras</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The hand</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The scene</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The plots</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Calibration</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Fitting the hand to pictures</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The tracker</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Streams to other programs</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The 3-D mouse</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Recording and replay</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Settings</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>When something is wrong</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>RHOT guide</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The guide&apos;s pages are not installed here ({path}). They are in the project&apos;s docs/guide folder.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cancelled.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The program made a mistake ({name}: {exc}). Please report it.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Start and Stop</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>opening menus</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>the list of sentences</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{text} is the key of {holder}. Choose another, or take it from there first.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The first page</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The rig that was opened last</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The simulated rig</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>More controls</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>see the package&apos;s own files</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>About RHOT</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Low-cost hand and object tracking with cheap cameras. RHOT itself has the MIT licence.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Put this into a report of a fault. `rhot report` collects more.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Package</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Version</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Licence</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Packages and licences</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Versions</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Licences</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Copy</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Copy the versions, for a report of a fault.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Close</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Open a rig file</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Rig files (*.json);;All files (*)</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>What happens here?</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Recordings (*.rhotlog);;All files (*)</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{folder}: cannot be made ({strerror}), so nothing is recorded.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Nothing is being recorded, so there is nothing to put a bookmark into. R records.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Bookmark “{text}” is set.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{path}: the recording cannot be found ({strerror}).</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source> The cameras keep its videos until Rig, Recordings collects them.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Recorded {size} to {path}.{video}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Show in folder</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>This desktop opens no folders. The recording lies in {folder}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>camera</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>picture [px]</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>field of view</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>focal length [px]</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>centre [px]</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>address : port</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>marker</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>colour</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>place</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>shape</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>radius [mm]</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>finger</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>first bone [mm]</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>second [mm]</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>last [mm]</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>marker to last joint [mm]</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The rig has one camera; depth needs two.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Where {first} and {second} stand to each other is not known.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{first} and {second} stand {distance:.1f} mm apart.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Rig {name}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Marker set {name}. Nodes and master must use the same one.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>without a name</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{name}, {hand}; wrist {breadth:.0f} × {thickness:.0f} mm.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Hand</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>beside the recording</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>General</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Reset all</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Forget layout, last rig, switches, folders and keys.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Every change holds already.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The file in which the app remembers all this.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Light text on dark ground, or the other way round. The View menu has it, too.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>What the app opens when it starts without a rig. An engine that runs already comes first.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Show what to do next when cameras of this computer are opened</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Where recordings are made and listed.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Where exported files are offered to be written.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Look</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>At the start, open</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Recordings</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Exported files</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Choose …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Another folder.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>As at first</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The folder that it was on the first start.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Action</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Key</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Keys of all actions</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Press the new key here; the cross takes the key away.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The key that the action had on the first start.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Key of the selected action</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Space starts and stops always. Windows beside the main one have keys of their own; the guide lists them.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Plots</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>This rig has no file, so nothing is kept: it can be brought back here, until this window closes.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>What is in the rig file now is kept, and can be brought back at any time with Calibrate, Bring back an earlier calibration.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Nothing changes.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{title}. Then the engine changes over.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The engine changes over …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>never arrived: the network lost them</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>came too late: this computer or the network is busy</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>could not be read in time: this computer is busy</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>of another marker set than the rig&apos;s</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>landmarks, but no marker of the rig is one</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>of another picture size than the rig&apos;s</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>of another node</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>came twice</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>an observation kind failed over them</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>not signed with the node&apos;s key</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>not signed</source>
        <translation type="unfinished"></translation>
    </message>
    <message numerus="yes">
        <source>{n} frame unused</source>
        <comment>{n} frames unused</comment>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>{n} frame received.</source>
        <comment>{n} frames received.</comment>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message>
        <source>Unused:</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>refused ({reason})</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Sends the thesis&apos;s text datagrams: untrusted.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Not paired: untrusted; anybody on the network may steer it or speak in its place.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>no clock (text)</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>clock unknown</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>clock ± {bound:.2f} ms</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>± {spread} mm (one sigma)</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>, {more:.2f} mm of it by the calibration</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>At least: {reason}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>epipolar error {error:.2f} px</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>IDLE</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Nothing is running. Press Start to begin.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>SEARCHING</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The nodes stream, but the hand has not been found yet.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>TRACKING</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The hand is tracked, and its markers, landmarks or contours are seen by enough cameras.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>PARTIAL</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The hand is tracked, but some of its markers, landmarks or contours are not seen by enough cameras.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>LOST</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The hand was tracked and is out of sight now.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>FAULT</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Something is broken; the sentence below says what.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>NO RIG</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No rig is open. Choose one to begin.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>STARTING</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The engine is starting.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>NO ENGINE</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The engine does not answer. The app is starting it again.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>This state is not known to this version.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>silent</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Nothing has been heard from this node for a second.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>starting</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The node is opening its camera.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>ready</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The node waits for the start message.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>streaming</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The node sends what it sees.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>fault</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The node reports that something is broken.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>measured</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Seen by enough cameras at this instant. Drawn solid.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>inferred</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Follows from what is measured through the hand model, or from a half-hidden sight. Drawn translucent.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>guessed</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The images do not determine it: the last or the most natural value. Drawn hatched.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>unknown</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Nothing is known. Not drawn.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>detect</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>network</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>pair</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>triangulate</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>filter</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>solve</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>publish</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>receive to state</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>ok</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Seen by every camera.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>half hidden</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>A camera sees only a part of it; its place is less certain.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>ambiguous</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Another spot of the same colour is as plausible.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>lost</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No camera sees it.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{names} only</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Not every camera sees it, so its depth is not measured.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The state of the whole rig in one word: IDLE, SEARCHING, TRACKING, PARTIAL, LOST or FAULT.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>How many hand states per second the engine publishes.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The rig file: cameras, lenses, marker set, hand and filters.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>A small computer with a camera. It finds the markers in its picture and sends their places.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Frames per second that arrive from this node.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Frames that were not used since the start, shown when they are more than one in a hundred. The hint of the card says why.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Datagrams that arrived and were rejected, with the reason.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>How well the node&apos;s clock is known: the true offset lies within this bound of the estimate. 1 ms at 1 m/s is 1 mm.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>A coloured spot on the hand: five painted fingertips and a wrist band.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>How much a marker trembles: rms over the last second of its raw position, motion removed by third differences. It includes depth, which is the noisiest direction. There is no figure below about ten states per second.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>How long each stage took for one state: median (p50) and 99th percentile (p99) of the last two seconds. Bands are stacked medians; the lines are the whole way of each state.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>11.1 ms is one frame at 90 fps, the rate the thesis aims at.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>From the frame being available on the node to the datagram being sent.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>From the node&apos;s send to the receive time of the master&apos;s kernel, by the estimated clocks.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Waiting until both cameras have seen a time after the state&apos;s instant.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>From two pixels to a point in space.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The 1-euro filter before and after depth.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>From points to the hand&apos;s joints.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>From the finished state to the clients.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>States per second and frames per second of each node; bars show lost datagrams per second.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>How far the fingertips of the two runs are apart at the same instant, in mm. p50 and p95 are over the whole recording.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Bending towards the palm, in degrees; 0 is a straight finger.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Spreading towards the thumb&apos;s side, in degrees.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Carpometacarpal joint: the thumb&apos;s base, at the wrist.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Metacarpophalangeal joint: the knuckle.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Proximal interphalangeal joint: the middle joint of a finger.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Distal interphalangeal joint: the last joint of a finger.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Interphalangeal joint: the last joint of the thumb.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>An ellipsoid of three sigma holds the true place with 97 % probability.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Standard deviation (one sigma) of the place along the axis in which it is known worst, in mm.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>How well the palm&apos;s place and turn are known: standard deviations along the worst axes.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Estimated size of the hand as a factor on every length of the rig&apos;s hand (Calibrate, Tracker).</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>How far the two cameras&apos; rays miss each other, in pixels. Above one pixel, check calibration.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>thumb</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>index</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>middle</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>ring</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>little</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>wrist</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>thumb tip</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>index tip</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>middle tip</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>ring tip</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>little tip</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>left</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>right</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>red</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>green</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>blue</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>yellow</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>magenta</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>cyan</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>orange</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>white</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>black</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>free</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>disc</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>sphere</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>capsule</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>band</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>blob</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>landmark</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>left hand</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>right hand</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>first left hand</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>other left hand</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>first right hand</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>other right hand</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Classic</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The thesis&apos;s way: triangulate each marker, smooth it, then bend the fingers one by one. Works with every rig. A marker needs two cameras, and joints do not say how well they are known.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Estimator</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>One hand estimated from everything that every camera sees, at the time it was seen. A marker that one camera sees counts, hidden fingers are carried on, and every joint says how well it is known. It predicts, and smooths recordings. Needs calibrated cameras with clocks.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>FABRIK, allowing for noise</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>FABRIK, then a descent to the natural pose. The default.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Jacobian transpose</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Equation 2.13. Slow where a finger is nearly straight.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>pseudo-inverse</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Equation 2.16. Jumps near a straight finger.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>singular values</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Equation 2.20: the pseudo-inverse without its small singular values.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>damped least squares</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Equation 2.23.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Newton</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Equation 2.24, with the exact second derivatives.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Levenberg-Marquardt</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Damped Gauss-Newton steps within the limits.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>closed form</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Equation 2.4: the last two joints bend together, DIP = 2/3 PIP.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>full: every joint by itself</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>27 degrees of freedom. The default.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>coupled: last joints follow</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>DIP = 2/3 PIP, and the middle finger does not spread. Steadier with markers on the tips only; wrong for a fingertip that is pushed back.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>anatomical: what hands do</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>How far each joint goes in living hands. The default.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>thesis: equation 2.1</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The thesis&apos;s ranges, for comparing with it; some are too narrow for living hands.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Paint</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The painted markers of the rig&apos;s marker set.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Landmarks</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The joints that a detector finds on a bare hand, in the nodes or in another program. The rig&apos;s marker set is landmarks21 or another one with landmarks.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Contours</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No markers: the nodes search their pictures for the bare hand&apos;s edges. Calibrate, Background and skin comes first; then take the pose that the pictures show, and hold it.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Paint and contours</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The hand&apos;s edges beside its painted markers, such as two fingertips. Calibrate, Background and skin comes first here, too.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Landmarks and contours</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The bare hand&apos;s edges beside a detector&apos;s landmarks, which find the hand at once. Calibrate, Background and skin comes first here, too.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The rig&apos;s marker set has landmarks, no paint: they are tracked. Choose Landmarks to say so.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The hand lies flat, as the 3-D mouse has it: only forefinger, thumb and little finger move. Where a board on the table has placed the rig, the palm slides on the table, and one camera suffices.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The hand&apos;s size is estimated as it moves, so that a hand file that is some percent too large or too small does no harm. Open and close the hand for half a minute.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No size yet: start, and show the hand.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{scale_text} of the rig&apos;s hand: not certain yet. Open and close the hand, and turn it.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{scale_text} of the rig&apos;s hand: it fits ({before:.0f} mm from wrist to middle fingertip).</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{scale_text} of the rig&apos;s hand: {after:.0f} mm long instead of {before:.0f} mm.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>a moment left</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>about {left:.0f} s left</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>about {left:.0f} min left</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>good</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>May be used as it is.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>usable</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>May be used; better is possible.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>not usable</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Must not be used.</source>
        <translation type="unfinished"></translation>
    </message>
    <message numerus="yes">
        <source>{n} &amp;more</source>
        <comment>{n} &amp;more</comment>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message>
        <source>Advice</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Take this pose with {hands}, and hold it</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Take this pose</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>the hand</source>
        <comment>Take this pose with the hand</comment>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Picture of camera {name}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Camera {name}: what it saw a moment ago, and the markers found in that picture.
A full ring is a marker seen whole, a broken ring one that is half hidden or doubtful.
Names stand in large pictures, and in small ones while the mouse is over them.
Of a bare hand: green its outline, blue contours within it, red the edges that are its, yellow others; white a pose that the hand is to take before it is followed.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>no picture yet</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>each hand</source>
        <comment>Take this pose with each hand</comment>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>the left hand</source>
        <comment>Take this pose with the left hand</comment>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>the right hand</source>
        <comment>Take this pose with the right hand</comment>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Pictures appear here once a rig is open and its nodes answer.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>spread</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>turn</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>palm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>; size {size}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Show the {hand}&apos;s angles. It is {word}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>not tracking</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The nodes do not stream. Press Start.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>not seen</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Nothing has been seen of it for a second.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No rig is open.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Node {name}: {word}, {rate}, {losses}, {clock}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No word from the engine about its nodes.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>AMBIGUOUS</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>PREDICTED</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No camera has seen it yet. Are its tags in sight, sharp and at least 20 px large?</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Seen within the last tenth of a second.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Two poses explain its tags. Show a second tag, or the tag to a second camera.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Not seen for a tenth of a second; it is where it would be if it went on moving.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Not seen for half a second.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{name}: no state yet</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{finger} touches</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>State: {word} {rate}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Jitter per marker</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>mm rms</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Latency by stage</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>budget</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>all</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>p50 of all</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>p99 of all</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Rate and losses</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>per second</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>states</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>lost /s</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{name}: {value:.3g} {unit}, above the axis</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{more} more: scroll</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>More buttons</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Pause</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Stop the plot to look at it; the measurement goes on.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Reset</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Begin the plot anew and fit the axes.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Copy CSV</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Copy what the plot shows to the clipboard as comma-separated text.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>time before now [s]</source>
        <translation type="unfinished"></translation>
    </message>
    <message numerus="yes">
        <source>Copied “{title}” to the clipboard: {n} row of comma-separated text.</source>
        <comment>Copied “{title}” to the clipboard: {n} rows of comma-separated text.</comment>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message>
        <source>“{title}” shows nothing yet, so only the headings were copied.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>up [mm]</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>its uncertainty is not estimated</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{spread} along the worst axis (one sigma)</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>marker {name}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{finger} joint</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{finger} {name} joint</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>true size</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>drawn {factor} × larger</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{sigma:.0f} sigma of the pictures alone</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>, cut at {most:.0f} mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>tracker: {tracker}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Scene</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Three-dimensional scene of the hand and the cameras</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Start tracking</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Tell the nodes to stream (Space).</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Show or hide the panel.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Holds still</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Waves</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Waves briskly</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Moves every joint</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Moves and turns</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Holds a tagged cube</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The hand waves with a cube of 40 mm that has a tag on each face. Rig, Add a tracked object offers its file.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Takes its markers off</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>A bare hand that opens and closes.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Holds a bare hand still</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>A bare hand that does not move. Calibrate, Tracker chooses what follows it.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Leaves the pictures</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The background alone: Calibrate, Background and skin begins with it.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Shows a board</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>A chessboard of 9 x 6 corners, 25 mm squares, moved about with pauses.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Lays the board on the table</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The same board, lying on the table.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Shows a ruler</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>A paper ruler with two crosses, 200 mm apart.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>One painted ball, {distance} cm from the cameras, before the middle between them.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Shows one marker at</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Another motion</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>A cap on the lens of the camera {name}: it sees nothing until it is taken off.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The simulated cameras have stopped.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Start them again</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>This engine was started outside the app; closing the app lets it run on.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Recording to {path} ({size}).</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>REC {size}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Recording to {path}. A click here, or B, sets a bookmark.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>REPLAY {name}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>An engine replays {path}; Start replays it again.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Calibrate …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>This computer renders the simulated cameras at {achieved:.0f} of {preset:.0f} Hz; the tracking is real all the same.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The engine stopped. The app is starting it again; the nodes re-join by themselves.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The engine stopped and could not be started again.{reason}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Try again</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>One moment. Cancel ends what was started.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Choose how to begin. F1 opens the guide.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Press Start, or the space bar, to begin tracking.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Everything is in order.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The rig was saved to {path}. What stood there before is kept in {name}.history.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Add a tracked object</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Object files (*.json);;All files (*)</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Take {name} out of the rig; its file stays.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{name} is tracked from now on, and stands in the rig.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{name} is not tracked any more.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{words} Calibrate, Bring back an earlier calibration undoes it.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>How do you want to begin?</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>RHOT tracks a hand with cheap cameras: a bare hand with one, a hand that wears six colour markers with two. No camera at hand? The simulated rig shows everything.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>What the simulated hand does.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Motion of the simulated hand</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Start the simulated rig</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Open a rig file …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Choose cameras …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Two simulated cameras look at a simulated hand, through real node programs and the real network path.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cameras of this computer</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>A webcam or two, films, or a network camera such as a phone. One is enough to begin with a bare hand.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Two nodes</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Enter the addresses of two Raspberry Pis that run rhot-node, see whether they answer, and write a first rig file.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Rig file</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>A rig that was set up before: its cameras, lenses, marker set and hand.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Open {name}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The rig opened last: {name}</source>
        <translation type="unfinished"></translation>
    </message>
</context>
</TS>
