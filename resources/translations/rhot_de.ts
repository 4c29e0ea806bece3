<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="de" sourcelanguage="en">
<context>
    <name></name>
    <message>
        <source>of joints</source>
        <translation>der Gelenke</translation>
    </message>
    <message>
        <source>Of the hand&apos;s inner joints; the estimator estimates them.</source>
        <translation>Der inneren Gelenke der Hand; der Schätzer schätzt sie.</translation>
    </message>
    <message>
        <source>of fingertips</source>
        <translation>der Fingerspitzen</translation>
    </message>
    <message>
        <source>Of the fingertips; the estimator estimates them.</source>
        <translation>Der Fingerspitzen; der Schätzer schätzt sie.</translation>
    </message>
    <message>
        <source>of markers</source>
        <translation>der Marker</translation>
    </message>
    <message>
        <source>Of the markers, as far as they are not the fingertips drawn already.</source>
        <translation>Der Marker, soweit sie nicht schon als Fingerspitzen gezeichnet sind.</translation>
    </message>
    <message>
        <source>Start</source>
        <translation>Start</translation>
    </message>
    <message>
        <source>Stop</source>
        <translation>Stopp</translation>
    </message>
    <message>
        <source>Record</source>
        <translation>Aufnehmen</translation>
    </message>
    <message>
        <source>Stop recording</source>
        <translation>Aufnahme beenden</translation>
    </message>
    <message>
        <source>Tell the nodes to stream, or to stop.</source>
        <translation>Die Knoten senden lassen oder anhalten.</translation>
    </message>
    <message>
        <source>Write the raw log of all datagrams, or end it.</source>
        <translation>Alle Datagramme roh in eine Aufnahme schreiben oder sie beenden.</translation>
    </message>
    <message>
        <source>Bookmark</source>
        <translation>Lesezeichen</translation>
    </message>
    <message>
        <source>Write a few words about this moment into the recording.</source>
        <translation>Ein paar Worte über diesen Augenblick in die Aufnahme schreiben.</translation>
    </message>
    <message>
        <source>Record video, too</source>
        <translation>Auch Video aufnehmen</translation>
    </message>
    <message>
        <source>Each camera writes its own frames as long as the next recording lasts. Rig, Recordings fetches them afterwards.</source>
        <translation>Jede Kamera schreibt ihre eigenen Bilder, solange die nächste Aufnahme dauert. Rig, Aufnahmen holt sie danach ab.</translation>
    </message>
    <message>
        <source>Simulated rig</source>
        <translation>Simuliertes Rig</translation>
    </message>
    <message>
        <source>Start two simulated cameras that look at a simulated hand.</source>
        <translation>Zwei simulierte Kameras starten, die eine simulierte Hand sehen.</translation>
    </message>
    <message>
        <source>Simulated hand does</source>
        <translation>Was die simulierte Hand tut</translation>
    </message>
    <message>
        <source>Cover a simulated camera</source>
        <translation>Simulierte Kamera abdecken</translation>
    </message>
    <message>
        <source>Scene of the simulated rig</source>
        <translation>Szene des simulierten Rigs</translation>
    </message>
    <message>
        <source>Open a scene …</source>
        <translation>Szene öffnen …</translation>
    </message>
    <message>
        <source>Start the simulated rig on a scene file: its light, its cameras, and what stands before them.</source>
        <translation>Das simulierte Rig mit einer Szenendatei starten: ihr Licht, ihre Kameras und was vor ihnen steht.</translation>
    </message>
    <message>
        <source>Save the scene …</source>
        <translation>Szene speichern …</translation>
    </message>
    <message>
        <source>Write what the simulated rig is and shows to a file. Commands that simulate read it with --scene.</source>
        <translation>In eine Datei schreiben, was das simulierte Rig ist und zeigt. Befehle, die simulieren, lesen sie mit --scene.</translation>
    </message>
    <message>
        <source>Open rig file …</source>
        <translation>Rig-Datei öffnen …</translation>
    </message>
    <message>
        <source>Open a rig that was set up before.</source>
        <translation>Ein Rig öffnen, das schon eingerichtet ist.</translation>
    </message>
    <message>
        <source>Cameras of this computer …</source>
        <translation>Kameras dieses Rechners …</translation>
    </message>
    <message>
        <source>Choose webcams, films or network cameras, look at them, and track with them.</source>
        <translation>Webcams, Filme oder Netzwerkkameras auswählen, ansehen und mit ihnen verfolgen.</translation>
    </message>
    <message>
        <source>Connect nodes …</source>
        <translation>Knoten verbinden …</translation>
    </message>
    <message>
        <source>Enter the addresses of two nodes, see whether they answer, and write a rig file for them.</source>
        <translation>Die Adressen zweier Knoten eingeben, prüfen, ob sie antworten, und eine Rig-Datei für sie schreiben.</translation>
    </message>
    <message>
        <source>Export recording …</source>
        <translation>Aufnahme exportieren …</translation>
    </message>
    <message>
        <source>Write a recording&apos;s hand as a file for other programs: tables, motion capture, animation.</source>
        <translation>Die Hand einer Aufnahme als Datei für andere Programme schreiben: Tabellen, Motion Capture, Animation.</translation>
    </message>
    <message>
        <source>Open recording …</source>
        <translation>Aufnahme öffnen …</translation>
    </message>
    <message>
        <source>Track a recording and play it, in a window of its own.</source>
        <translation>Eine Aufnahme verfolgen und in einem eigenen Fenster abspielen.</translation>
    </message>
    <message>
        <source>Recordings …</source>
        <translation>Aufnahmen …</translation>
    </message>
    <message>
        <source>All recordings: how long and how well tracked; open, rename, delete.</source>
        <translation>Alle Aufnahmen: wie lang und wie gut verfolgt; öffnen, umbenennen, löschen.</translation>
    </message>
    <message>
        <source>Track films …</source>
        <translation>Filme verfolgen …</translation>
    </message>
    <message>
        <source>Track a bare hand in films that you have already, and replay it beside their pictures.</source>
        <translation>Eine bloße Hand in vorhandenen Filmen verfolgen und neben deren Bildern abspielen.</translation>
    </message>
    <message>
        <source>Outputs …</source>
        <translation>Ausgaben …</translation>
    </message>
    <message>
        <source>Live streams to other programs: OSC, VMC, WebSocket, web view and others; which run, and how they go.</source>
        <translation>Live-Datenströme an andere Programme: OSC, VMC, WebSocket, Webansicht und weitere; welche laufen und wie gut.</translation>
    </message>
    <message>
        <source>3-D mouse …</source>
        <translation>3-D-Maus …</translation>
    </message>
    <message>
        <source>Work a cursor in three dimensions with the hand: pick balls, move them, and take a target test.</source>
        <translation>Mit der Hand einen Zeiger im Raum führen: Kugeln greifen, bewegen und einen Zieltest machen.</translation>
    </message>
    <message>
        <source>Add a tracked object …</source>
        <translation>Verfolgtes Objekt hinzufügen …</translation>
    </message>
    <message>
        <source>Track an object with tags or colour markers beside the hand: choose its object file.</source>
        <translation>Neben der Hand ein Objekt mit Tags oder Farbmarkern verfolgen: seine Objektdatei auswählen.</translation>
    </message>
    <message>
        <source>Remove a tracked object</source>
        <translation>Verfolgtes Objekt entfernen</translation>
    </message>
    <message>
        <source>Save rig</source>
        <translation>Rig speichern</translation>
    </message>
    <message>
        <source>Write the rig as it is now to its file; what stood there is kept beside it.</source>
        <translation>Das Rig, wie es jetzt ist, in seine Datei schreiben; was dort stand, bleibt daneben erhalten.</translation>
    </message>
    <message>
        <source>Close rig</source>
        <translation>Rig schließen</translation>
    </message>
    <message>
        <source>End what the app started and go back to the first page.</source>
        <translation>Beenden, was die App gestartet hat, und zurück zur ersten Seite.</translation>
    </message>
    <message>
        <source>Settings …</source>
        <translation>Einstellungen …</translation>
    </message>
    <message>
        <source>Look, folders, what opens at the start, and keys.</source>
        <translation>Aussehen, Ordner, was beim Start geöffnet wird, und Tasten.</translation>
    </message>
    <message>
        <source>Quit</source>
        <translation>Beenden</translation>
    </message>
    <message>
        <source>End what the app started and close it.</source>
        <translation>Beenden, was die App gestartet hat, und sie schließen.</translation>
    </message>
    <message>
        <source>What to do next …</source>
        <translation>Was als Nächstes zu tun ist …</translation>
    </message>
    <message>
        <source>Say what you have, and see the steps that are missing.</source>
        <translation>Angeben, was vorhanden ist, und sehen, welche Schritte fehlen.</translation>
    </message>
    <message>
        <source>Fit the hand to pictures …</source>
        <translation>Hand an Bilder anpassen …</translation>
    </message>
    <message>
        <source>Drag joints in the cameras&apos; pictures, move sliders, and let edges finish it: the hand&apos;s lengths and pose.</source>
        <translation>Gelenke in den Kamerabildern ziehen, Regler verschieben und die Kanten den Rest machen lassen: Längen und Pose der Hand.</translation>
    </message>
    <message>
        <source>Bring back an earlier calibration …</source>
        <translation>Frühere Kalibrierung zurückholen …</translation>
    </message>
    <message>
        <source>Every calibration keeps what it replaced; choose one by date and reason.</source>
        <translation>Jede Kalibrierung bewahrt, was sie ersetzt hat; nach Datum und Grund auswählen.</translation>
    </message>
    <message>
        <source>Tracker …</source>
        <translation>Tracker …</translation>
    </message>
    <message>
        <source>Which tracker makes a hand of the markers, and what it may assume.</source>
        <translation>Welcher Tracker aus den Markern eine Hand macht und was er annehmen darf.</translation>
    </message>
    <message>
        <source>Hand networks …</source>
        <translation>Hand-Netze …</translation>
    </message>
    <message>
        <source>Install the networks that find landmarks of a bare hand on this computer.</source>
        <translation>Die Netze, die Landmarken einer bloßen Hand finden, auf diesem Rechner installieren.</translation>
    </message>
    <message>
        <source>Cameras …</source>
        <translation>Kameras …</translation>
    </message>
    <message>
        <source>Lenses and positions that the rig file says.</source>
        <translation>Objektive und Positionen, wie sie in der Rig-Datei stehen.</translation>
    </message>
    <message>
        <source>Markers …</source>
        <translation>Marker …</translation>
    </message>
    <message>
        <source>The marker set that the rig file says.</source>
        <translation>Der Markersatz, wie er in der Rig-Datei steht.</translation>
    </message>
    <message>
        <source>Hand …</source>
        <translation>Hand …</translation>
    </message>
    <message>
        <source>The hand&apos;s bones that the rig file says.</source>
        <translation>Die Knochen der Hand, wie sie in der Rig-Datei stehen.</translation>
    </message>
    <message>
        <source>Properties</source>
        <translation>Eigenschaften</translation>
    </message>
    <message>
        <source>What the rig file says, to read.</source>
        <translation>Was die Rig-Datei sagt, zum Nachlesen.</translation>
    </message>
    <message>
        <source>How to calibrate</source>
        <translation>Wie man kalibriert</translation>
    </message>
    <message>
        <source>Opens the guide.</source>
        <translation>Öffnet die Anleitung.</translation>
    </message>
    <message>
        <source>Frame the hand</source>
        <translation>Hand ins Bild holen</translation>
    </message>
    <message>
        <source>Bring the hand into the middle of the scene.</source>
        <translation>Die Hand in die Mitte der Szene holen.</translation>
    </message>
    <message>
        <source>Reset the view</source>
        <translation>Ansicht zurücksetzen</translation>
    </message>
    <message>
        <source>Back to the view from behind the cameras.</source>
        <translation>Zurück zum Blick von hinter den Kameras.</translation>
    </message>
    <message>
        <source>Marker names</source>
        <translation>Markernamen</translation>
    </message>
    <message>
        <source>Names beside the markers in the scene.</source>
        <translation>Namen neben den Markern in der Szene.</translation>
    </message>
    <message>
        <source>Hand as of now</source>
        <translation>Hand von jetzt</translation>
    </message>
    <message>
        <source>Draw the hand where it is when you see it, not where it was in the newest pictures, 10 to 40 ms before. The estimator predicts it.</source>
        <translation>Die Hand dort zeichnen, wo sie beim Hinsehen ist, nicht dort, wo sie in den neuesten Bildern 10 bis 40 ms vorher war. Der Schätzer sagt sie voraus.</translation>
    </message>
    <message>
        <source>Uncertainty</source>
        <translation>Unsicherheit</translation>
    </message>
    <message>
        <source>How well places are known, as ellipsoids: the true place lies inside in 97 of 100 cases (three sigma).</source>
        <translation>Wie gut Orte bekannt sind, als Ellipsoide: In 97 von 100 Fällen liegt der wahre Ort darin (drei Sigma).</translation>
    </message>
    <message>
        <source>Ellipsoids in true size.</source>
        <translation>Ellipsoide in wahrer Größe.</translation>
    </message>
    <message>
        <source>Ellipsoids {larger} times as large, because a good place is known to a millimetre.</source>
        <translation>Ellipsoide {larger}-mal so groß, weil ein guter Ort auf einen Millimeter bekannt ist.</translation>
    </message>
    <message>
        <source>Layers of the hand …</source>
        <translation>Ebenen der Hand …</translation>
    </message>
    <message>
        <source>Which link of the tracked hand hides which before a camera, as masks over its picture.</source>
        <translation>Welches Glied der verfolgten Hand vor einer Kamera welches verdeckt, als Masken über ihrem Bild.</translation>
    </message>
    <message>
        <source>Scene alone</source>
        <translation>Nur die Szene</translation>
    </message>
    <message>
        <source>Hide every panel, to look from afar; again brings them back.</source>
        <translation>Alle Felder ausblenden, um von weitem zu sehen; noch einmal holt sie zurück.</translation>
    </message>
    <message>
        <source>Dark</source>
        <translation>Dunkel</translation>
    </message>
    <message>
        <source>Light text on dark ground.</source>
        <translation>Heller Text auf dunklem Grund.</translation>
    </message>
    <message>
        <source>Light</source>
        <translation>Hell</translation>
    </message>
    <message>
        <source>Dark text on light ground.</source>
        <translation>Dunkler Text auf hellem Grund.</translation>
    </message>
    <message>
        <source>Reset layout and settings</source>
        <translation>Anordnung und Einstellungen zurücksetzen</translation>
    </message>
    <message>
        <source>Forget layout, last rig and switches.</source>
        <translation>Anordnung, letztes Rig und Schalter vergessen.</translation>
    </message>
    <message>
        <source>Guide</source>
        <translation>Anleitung</translation>
    </message>
    <message>
        <source>The page of the guide that explains the panel in use.</source>
        <translation>Die Seite der Anleitung, die das benutzte Feld erklärt.</translation>
    </message>
    <message>
        <source>Keys</source>
        <translation>Tasten</translation>
    </message>
    <message>
        <source>The guide&apos;s page about keys.</source>
        <translation>Die Seite der Anleitung über Tasten.</translation>
    </message>
    <message>
        <source>About RHOT …</source>
        <translation>Über RHOT …</translation>
    </message>
    <message>
        <source>Versions for a report of a fault, and licences.</source>
        <translation>Versionen für einen Fehlerbericht und Lizenzen.</translation>
    </message>
    <message>
        <source>Main</source>
        <translation>Hauptleiste</translation>
    </message>
    <message>
        <source>Rig</source>
        <translation>Rig</translation>
    </message>
    <message>
        <source>Calibrate</source>
        <translation>Kalibrieren</translation>
    </message>
    <message>
        <source>View</source>
        <translation>Ansicht</translation>
    </message>
    <message>
        <source>Help</source>
        <translation>Hilfe</translation>
    </message>
    <message>
        <source>rig: {name} (edited)</source>
        <translation>Rig: {name} (geändert)</translation>
    </message>
    <message>
        <source>rig: {name}</source>
        <translation>Rig: {name}</translation>
    </message>
    <message>
        <source>The engine&apos;s rig differs from this file; Rig, Save rig writes it.</source>
        <translation>Das Rig der Engine weicht von dieser Datei ab; Rig, Rig speichern schreibt es.</translation>
    </message>
    <message>
        <source>Attaching to the running engine …</source>
        <translation>Verbindung mit der laufenden Engine …</translation>
    </message>
    <message>
        <source>Reading the rig file …</source>
        <translation>Die Rig-Datei wird gelesen …</translation>
    </message>
    <message>
        <source>Starting two simulated cameras …</source>
        <translation>Zwei simulierte Kameras werden gestartet …</translation>
    </message>
    <message>
        <source>The engine had no rig file, so it cannot be started again. Open a rig.</source>
        <translation>Die Engine hatte keine Rig-Datei und lässt sich daher nicht neu starten. Ein Rig öffnen.</translation>
    </message>
    <message>
        <source>Starting the engine again …</source>
        <translation>Die Engine wird neu gestartet …</translation>
    </message>
    <message>
        <source>The engine in {path} was not started by this app and goes on running.</source>
        <translation>Die Engine in {path} wurde nicht von dieser App gestartet und läuft weiter.</translation>
    </message>
    <message>
        <source>Ending what ran before …</source>
        <translation>Was vorher lief, wird beendet …</translation>
    </message>
    <message>
        <source>The engine in {path} records to {log_path}. Stop that recording first, or start with another --directory.</source>
        <translation>Die Engine in {path} nimmt in {log_path} auf. Zuerst diese Aufnahme beenden oder mit einem anderen --directory starten.</translation>
    </message>
    <message>
        <source>The engine in {path} records to {log_path} and gives no answer in {limit:g} s. Try again, or end it with `kill {pid}`; what it has recorded is kept.</source>
        <translation>Die Engine in {path} nimmt in {log_path} auf und antwortet seit {limit:g} s nicht. Noch einmal versuchen oder sie mit `kill {pid}` beenden; was sie aufgenommen hat, bleibt erhalten.</translation>
    </message>
    <message>
        <source>An engine that was started by hand runs in {path}. Stop it first, or start the app with another --directory.</source>
        <translation>Eine von Hand gestartete Engine läuft in {path}. Sie zuerst anhalten oder die App mit einem anderen --directory starten.</translation>
    </message>
    <message>
        <source>Starting the engine …</source>
        <translation>Die Engine wird gestartet …</translation>
    </message>
    <message>
        <source>Asking the engine for its rig …</source>
        <translation>Die Engine wird nach ihrem Rig gefragt …</translation>
    </message>
    <message>
        <source>simulated cameras</source>
        <translation>simulierten Kameras</translation>
    </message>
    <message>
        <source>cameras</source>
        <translation>Kameras</translation>
    </message>
    <message>
        <source>they said nothing; see {errors}</source>
        <translation>sie haben nichts gesagt; siehe {errors}</translation>
    </message>
    <message>
        <source>The {what} did not start: {said}</source>
        <translation>Die {what} sind nicht gestartet: {said}</translation>
    </message>
    <message numerus="yes">
        <source>Starting {n} camera …</source>
        <comment>Starting {n} cameras …</comment>
        <translation>
            <numerusform>{n} Kamera wird gestartet …</numerusform>
            <numerusform>{n} Kameras werden gestartet …</numerusform>
        </translation>
    </message>
    <message>
        <source>The {what} were not ready within {limit:.0f} s; see {errors}.</source>
        <translation>Die {what} waren nach {limit:.0f} s nicht bereit; siehe {errors}.</translation>
    </message>
    <message>
        <source>The simulated rig has no {what!r} to show.</source>
        <translation>Das simulierte Rig hat kein {what!r} zu zeigen.</translation>
    </message>
    <message>
        <source>Opening the rig …</source>
        <translation>Das Rig wird geöffnet …</translation>
    </message>
    <message>
        <source>Starting the simulated rig …</source>
        <translation>Das simulierte Rig wird gestartet …</translation>
    </message>
    <message>
        <source>Cancelling …</source>
        <translation>Wird abgebrochen …</translation>
    </message>
    <message>
        <source>Closing the rig …</source>
        <translation>Das Rig wird geschlossen …</translation>
    </message>
    <message>
        <source>The engine stopped. Starting it again …</source>
        <translation>Die Engine ist stehen geblieben. Sie wird neu gestartet …</translation>
    </message>
    <message>
        <source>Getting started</source>
        <translation>Erste Schritte</translation>
    </message>
    <message>
        <source>The window</source>
        <translation>Das Fenster</translation>
    </message>
    <message>
        <source>Nodes</source>
        <translation>Knoten</translation>
    </message>
    <message>
        <source>Markers</source>
        <translation>Marker</translation>
    </message>
    <message>
        <source>Cameras</source>
        <translation>Kameras</translation>
    </message>
    <message>
        <source>The hand</source>
        <translation>Die Hand</translation>
    </message>
    <message>
        <source>The scene</source>
        <translation>Die Szene</translation>
    </message>
    <message>
        <source>The plots</source>
        <translation>Die Diagramme</translation>
    </message>
    <message>
        <source>Calibration</source>
        <translation>Kalibrierung</translation>
    </message>
    <message>
        <source>Fitting the hand to pictures</source>
        <translation>Die Hand an Bilder anpassen</translation>
    </message>
    <message>
        <source>The tracker</source>
        <translation>Der Tracker</translation>
    </message>
    <message>
        <source>Streams to other programs</source>
        <translation>Datenströme an andere Programme</translation>
    </message>
    <message>
        <source>The 3-D mouse</source>
        <translation>Die 3-D-Maus</translation>
    </message>
    <message>
        <source>Recording and replay</source>
        <translation>Aufnahme und Wiedergabe</translation>
    </message>
    <message>
        <source>Settings</source>
        <translation>Einstellungen</translation>
    </message>
    <message>
        <source>When something is wrong</source>
        <translation>Wenn etwas nicht stimmt</translation>
    </message>
    <message>
        <source>RHOT guide</source>
        <translation>RHOT-Anleitung</translation>
    </message>
    <message>
        <source>The guide&apos;s pages are not installed here ({path}). They are in the project&apos;s docs/guide folder.</source>
        <translation>Die Seiten der Anleitung sind hier nicht installiert ({path}). Sie liegen im Ordner docs/guide des Projekts.</translation>
    </message>
    <message>
        <source>Cancelled.</source>
        <translation>Abgebrochen.</translation>
    </message>
    <message>
        <source>The program made a mistake ({name}: {exc}). Please report it.</source>
        <translation>Das Programm hat einen Fehler gemacht ({name}: {exc}). Bitte melden.</translation>
    </message>
    <message>
        <source>Start and Stop</source>
        <translation>Start und Stopp</translation>
    </message>
    <message>
        <source>opening menus</source>
        <translation>das Öffnen der Menüs</translation>
    </message>
    <message>
        <source>the list of sentences</source>
        <translation>die Liste der Meldungen</translation>
    </message>
    <message>
        <source>the menu {menu}</source>
        <translation>das Menü {menu}</translation>
    </message>
    <message>
        <source>{text} is the key of {holder}. Choose another, or take it from there first.</source>
        <translation>{text} ist die Taste für „{holder}“. Eine andere wählen oder sie dort zuerst wegnehmen.</translation>
    </message>
    <message>
        <source>The first page</source>
        <translation>Die erste Seite</translation>
    </message>
    <message>
        <source>The rig that was opened last</source>
        <translation>Das zuletzt geöffnete Rig</translation>
    </message>
    <message>
        <source>The simulated rig</source>
        <translation>Das simulierte Rig</translation>
    </message>
    <message>
        <source>More controls</source>
        <translation>Weitere Bedienelemente</translation>
    </message>
    <message>
        <source>see the package&apos;s own files</source>
        <translation>siehe die Dateien des Pakets</translation>
    </message>
    <message>
        <source>About RHOT</source>
        <translation>Über RHOT</translation>
    </message>
    <message>
        <source>Low-cost hand and object tracking with cheap cameras. RHOT itself has the MIT licence.</source>
        <translation>Verfolgung von Hand und Objekten mit günstigen Kameras. RHOT selbst steht unter der MIT-Lizenz.</translation>
    </message>
    <message>
        <source>Put this into a report of a fault. `rhot report` collects more.</source>
        <translation>Gehört in einen Fehlerbericht. `rhot report` sammelt mehr.</translation>
    </message>
    <message>
        <source>Package</source>
        <translation>Paket</translation>
    </message>
    <message>
        <source>Version</source>
        <translation>Version</translation>
    </message>
    <message>
        <source>Licence</source>
        <translation>Lizenz</translation>
    </message>
    <message>
        <source>Packages and licences</source>
        <translation>Pakete und Lizenzen</translation>
    </message>
    <message>
        <source>Versions</source>
        <translation>Versionen</translation>
    </message>
    <message>
        <source>Licences</source>
        <translation>Lizenzen</translation>
    </message>
    <message>
        <source>Copy</source>
        <translation>Kopieren</translation>
    </message>
    <message>
        <source>Copy the versions, for a report of a fault.</source>
        <translation>Die Versionen für einen Fehlerbericht kopieren.</translation>
    </message>
    <message>
        <source>Close</source>
        <translation>Schließen</translation>
    </message>
    <message>
        <source>Open a rig file</source>
        <translation>Eine Rig-Datei öffnen</translation>
    </message>
    <message>
        <source>Rig files (*.json);;All files (*)</source>
        <translation>Rig-Dateien (*.json);;Alle Dateien (*)</translation>
    </message>
    <message>
        <source>What happens here?</source>
        <translation>Was geschieht hier?</translation>
    </message>
    <message>
        <source>Recordings (*.rhotlog);;All files (*)</source>
        <translation>Aufnahmen (*.rhotlog);;Alle Dateien (*)</translation>
    </message>
    <message>
        <source>{folder}: cannot be made ({strerror}), so nothing is recorded.</source>
        <translation>{folder}: lässt sich nicht anlegen ({strerror}), daher wird nichts aufgenommen.</translation>
    </message>
    <message>
        <source>Nothing is being recorded, so there is nothing to put a bookmark into. R records.</source>
        <translation>Es läuft keine Aufnahme, in die ein Lesezeichen passt. R nimmt auf.</translation>
    </message>
    <message>
        <source>Bookmark “{text}” is set.</source>
        <translation>Lesezeichen „{text}“ ist gesetzt.</translation>
    </message>
    <message>
        <source>{path}: the recording cannot be found ({strerror}).</source>
        <translation>{path}: Die Aufnahme ist nicht zu finden ({strerror}).</translation>
    </message>
    <message>
        <source> The cameras keep its videos until Rig, Recordings collects them.</source>
        <translation> Die Kameras behalten ihre Videos, bis Rig, Aufnahmen sie abholt.</translation>
    </message>
    <message>
        <source>Recorded {size} to {path}.{video}</source>
        <translation>{size} aufgenommen in {path}.{video}</translation>
    </message>
    <message>
        <source>Show in folder</source>
        <translation>Im Ordner zeigen</translation>
    </message>
    <message>
        <source>This desktop opens no folders. The recording lies in {folder}.</source>
        <translation>Dieser Desktop öffnet keine Ordner. Die Aufnahme liegt in {folder}.</translation>
    </message>
    <message>
        <source>Connect nodes</source>
        <translation>Knoten verbinden</translation>
    </message>
    <message>
        <source>Select a node in the list and say which camera it is. Left and right are as seen from behind the cameras. The address of a node that is not found can be typed in: it stands on the node&apos;s console, and &lt;b&gt;hostname&amp;nbsp;-I&lt;/b&gt; prints it there.</source>
        <translation>Einen Knoten in der Liste auswählen und sagen, welche Kamera er ist. Links und rechts gelten von hinter den Kameras gesehen. Die Adresse eines Knotens, der nicht gefunden wird, lässt sich eintippen: Sie steht auf seiner Konsole, und &lt;b&gt;hostname&amp;nbsp;-I&lt;/b&gt; gibt sie dort aus.</translation>
    </message>
    <message>
        <source>camera</source>
        <translation>Kamera</translation>
    </message>
    <message>
        <source>address or host name</source>
        <translation>Adresse oder Rechnername</translation>
    </message>
    <message>
        <source>port</source>
        <translation>Port</translation>
    </message>
    <message>
        <source>answer</source>
        <translation>Antwort</translation>
    </message>
    <message>
        <source>The port is {port} unless the node&apos;s settings file says otherwise (pairing_port).</source>
        <translation>Der Port ist {port}, wenn die Einstellungsdatei des Knotens nichts anderes sagt (pairing_port).</translation>
    </message>
    <message>
        <source>Ask the nodes</source>
        <translation>Knoten fragen</translation>
    </message>
    <message>
        <source>Possible once both addresses are entered. Nothing is changed on the nodes.</source>
        <translation>Möglich, sobald beide Adressen eingegeben sind. An den Knoten wird nichts geändert.</translation>
    </message>
    <message>
        <source>Write a rig file and open it …</source>
        <translation>Rig-Datei schreiben und öffnen …</translation>
    </message>
    <message>
        <source>Possible once both nodes have answered and are paired with this computer.</source>
        <translation>Möglich, sobald beide Knoten geantwortet haben und mit diesem Rechner gekoppelt sind.</translation>
    </message>
    <message>
        <source>not asked yet</source>
        <translation>noch nicht gefragt</translation>
    </message>
    <message>
        <source>e.g. {address}</source>
        <translation>z. B. {address}</translation>
    </message>
    <message>
        <source>Address of the {side} node</source>
        <translation>Adresse des Knotens {side}</translation>
    </message>
    <message>
        <source>Where the node says who it is. The default is right unless its settings file says otherwise.</source>
        <translation>Wo der Knoten sagt, wer er ist. Die Vorgabe stimmt, wenn seine Einstellungsdatei nichts anderes sagt.</translation>
    </message>
    <message>
        <source>Pairing port of the {side} node</source>
        <translation>Kopplungs-Port des Knotens {side}</translation>
    </message>
    <message>
        <source>Pair …</source>
        <translation>Koppeln …</translation>
    </message>
    <message>
        <source>Possible once the node has answered and is not paired with this computer.</source>
        <translation>Möglich, sobald der Knoten geantwortet hat und nicht mit diesem Rechner gekoppelt ist.</translation>
    </message>
    <message>
        <source>asking …</source>
        <translation>wird gefragt …</translation>
    </message>
    <message>
        <source>Both nodes answer. The new rig starts with textbook lenses and a 75 mm baseline: calibrate before you trust millimetres.</source>
        <translation>Beide Knoten antworten. Das neue Rig beginnt mit Lehrbuch-Objektiven und einer Basis von 75 mm: Erst kalibrieren, dann den Millimetern trauen.</translation>
    </message>
    <message>
        <source>Write the rig file</source>
        <translation>Die Rig-Datei schreiben</translation>
    </message>
    <message>
        <source>Rig files (*.json)</source>
        <translation>Rig-Dateien (*.json)</translation>
    </message>
    <message>
        <source>Pairing makes sure that this computer and the node know each other, so that nobody else on the network can see its pictures, steer it, or pretend to be it.

1. On the node {name}, at its console or over SSH, run:  rhot-node pair
2. It shows a code of three groups, such as 7K2QD-9M4XT-BNWH3. Type it here within five minutes.</source>
        <translation>Durch Koppeln kennen dieser Rechner und der Knoten einander, sodass niemand sonst im Netz seine Bilder sehen, ihn steuern oder sich für ihn ausgeben kann.

1. Auf dem Knoten {name}, an seiner Konsole oder über SSH, ausführen:  rhot-node pair
2. Er zeigt einen Code aus drei Gruppen, etwa 7K2QD-9M4XT-BNWH3. Ihn innerhalb von fünf Minuten hier eintippen.</translation>
    </message>
    <message>
        <source>Pair with {name}</source>
        <translation>Mit {name} koppeln</translation>
    </message>
    <message>
        <source>code shown by the node</source>
        <translation>Code, den der Knoten zeigt</translation>
    </message>
    <message>
        <source>Pairing code</source>
        <translation>Kopplungscode</translation>
    </message>
    <message>
        <source>Pair</source>
        <translation>Koppeln</translation>
    </message>
    <message>
        <source>Possible once {code_length} letters and digits are entered; dashes are free.</source>
        <translation>Möglich, sobald {code_length} Buchstaben und Ziffern eingegeben sind; Striche sind frei.</translation>
    </message>
    <message>
        <source>pairing …</source>
        <translation>wird gekoppelt …</translation>
    </message>
    <message>
        <source>picture [px]</source>
        <translation>Bild [px]</translation>
    </message>
    <message>
        <source>field of view</source>
        <translation>Bildwinkel</translation>
    </message>
    <message>
        <source>focal length [px]</source>
        <translation>Brennweite [px]</translation>
    </message>
    <message>
        <source>centre [px]</source>
        <translation>Hauptpunkt [px]</translation>
    </message>
    <message>
        <source>address : port</source>
        <translation>Adresse : Port</translation>
    </message>
    <message>
        <source>marker</source>
        <translation>Marker</translation>
    </message>
    <message>
        <source>colour</source>
        <translation>Farbe</translation>
    </message>
    <message>
        <source>place</source>
        <translation>Ort</translation>
    </message>
    <message>
        <source>shape</source>
        <translation>Form</translation>
    </message>
    <message>
        <source>radius [mm]</source>
        <translation>Radius [mm]</translation>
    </message>
    <message>
        <source>finger</source>
        <translation>Finger</translation>
    </message>
    <message>
        <source>first bone [mm]</source>
        <translation>erster Knochen [mm]</translation>
    </message>
    <message>
        <source>second [mm]</source>
        <translation>zweiter [mm]</translation>
    </message>
    <message>
        <source>last [mm]</source>
        <translation>letzter [mm]</translation>
    </message>
    <message>
        <source>marker to last joint [mm]</source>
        <translation>Marker bis letztes Gelenk [mm]</translation>
    </message>
    <message>
        <source>The rig has one camera; depth needs two.</source>
        <translation>Das Rig hat eine Kamera; Tiefe braucht zwei.</translation>
    </message>
    <message>
        <source>Where {first} and {second} stand to each other is not known.</source>
        <translation>Wie {first} und {second} zueinander stehen, ist nicht bekannt.</translation>
    </message>
    <message>
        <source>{first} and {second} stand {distance:.1f} mm apart.</source>
        <translation>{first} und {second} stehen {distance:.1f} mm auseinander.</translation>
    </message>
    <message>
        <source>Rig {name}</source>
        <translation>Rig {name}</translation>
    </message>
    <message>
        <source>Marker set {name}. Nodes and master must use the same one.</source>
        <translation>Markersatz {name}. Knoten und Master müssen denselben benutzen.</translation>
    </message>
    <message>
        <source>without a name</source>
        <translation>ohne Namen</translation>
    </message>
    <message>
        <source>{name}, {hand}; wrist {breadth:.0f} × {thickness:.0f} mm.</source>
        <translation>{name}, {hand}; Handgelenk {breadth:.0f} × {thickness:.0f} mm.</translation>
    </message>
    <message>
        <source>{name} ({device})
cannot be used now</source>
        <translation>{name} ({device})
jetzt nicht benutzbar</translation>
    </message>
    <message>
        <source>Tick one camera or more, and look at each. The first one tracks alone until the others are put together with it.</source>
        <translation>Eine oder mehrere Kameras ankreuzen und jede ansehen. Die erste verfolgt allein, bis die anderen mit ihr zusammengesetzt sind.</translation>
    </message>
    <message>
        <source>Films …</source>
        <translation>Filme …</translation>
    </message>
    <message>
        <source>Add films of one camera each, recorded at the same time.</source>
        <translation>Filme je einer Kamera hinzufügen, die gleichzeitig aufgenommen wurden.</translation>
    </message>
    <message>
        <source>Folder …</source>
        <translation>Ordner …</translation>
    </message>
    <message>
        <source>Add a folder of pictures, or of raw frames.</source>
        <translation>Einen Ordner mit Bildern oder Rohbildern hinzufügen.</translation>
    </message>
    <message>
        <source>Network …</source>
        <translation>Netz …</translation>
    </message>
    <message>
        <source>Add a camera or a phone that sends its pictures by HTTP (motion JPEG) or RTSP.</source>
        <translation>Eine Kamera oder ein Telefon hinzufügen, das seine Bilder per HTTP (Motion JPEG) oder RTSP sendet.</translation>
    </message>
    <message>
        <source>Search again</source>
        <translation>Neu suchen</translation>
    </message>
    <message>
        <source>Look for webcams that were plugged in meanwhile.</source>
        <translation>Nach Webcams suchen, die inzwischen angesteckt wurden.</translation>
    </message>
    <message>
        <source>Name of the camera</source>
        <translation>Name der Kamera</translation>
    </message>
    <message>
        <source>How the camera is called in the rig, such as left.</source>
        <translation>Wie die Kamera im Rig heißt, etwa left.</translation>
    </message>
    <message>
        <source>Picture size and rate</source>
        <translation>Bildgröße und Rate</translation>
    </message>
    <message>
        <source>Larger pictures show a hand farther away, and take longer to search.</source>
        <translation>Größere Bilder zeigen eine Hand in größerer Entfernung und brauchen länger zum Durchsuchen.</translation>
    </message>
    <message>
        <source>upside down</source>
        <translation>kopfüber</translation>
    </message>
    <message>
        <source>mirrored</source>
        <translation>gespiegelt</translation>
    </message>
    <message>
        <source>Turn the picture by 180 degrees: the camera hangs upside down.</source>
        <translation>Das Bild um 180 Grad drehen: Die Kamera hängt kopfüber.</translation>
    </message>
    <message>
        <source>Exchange left and right, where a phone&apos;s program has mirrored the picture. In a mirrored picture a right hand looks like a left one.</source>
        <translation>Links und rechts vertauschen, wo das Programm eines Telefons das Bild gespiegelt hat. In einem gespiegelten Bild sieht eine rechte Hand wie eine linke aus.</translation>
    </message>
    <message>
        <source>the right hand</source>
        <translation>die rechte Hand</translation>
    </message>
    <message>
        <source>the left hand</source>
        <translation>die linke Hand</translation>
    </message>
    <message>
        <source>Hand</source>
        <translation>Hand</translation>
    </message>
    <message>
        <source>Which hand is tracked.</source>
        <translation>Welche Hand verfolgt wird.</translation>
    </message>
    <message>
        <source>Open</source>
        <translation>Öffnen</translation>
    </message>
    <message>
        <source>Possible once a camera is ticked.</source>
        <translation>Möglich, sobald eine Kamera angekreuzt ist.</translation>
    </message>
    <message>
        <source>name</source>
        <translation>Name</translation>
    </message>
    <message>
        <source>track</source>
        <translation>verfolgen</translation>
    </message>
    <message>
        <source>Films of one camera each</source>
        <translation>Filme je einer Kamera</translation>
    </message>
    <message>
        <source>Films and pictures (*.mp4 *.avi *.mov *.mkv *.webm *.png *.jpg *.jpeg);;All files (*)</source>
        <translation>Filme und Bilder (*.mp4 *.avi *.mov *.mkv *.webm *.png *.jpg *.jpeg);;Alle Dateien (*)</translation>
    </message>
    <message>
        <source>A folder of pictures</source>
        <translation>Ein Ordner mit Bildern</translation>
    </message>
    <message>
        <source>Network camera</source>
        <translation>Netzwerkkamera</translation>
    </message>
    <message>
        <source>Address of the pictures, such as
http://192.168.1.20:8080/video or rtsp://192.168.1.21/live</source>
        <translation>Adresse der Bilder, etwa
http://192.168.1.20:8080/video oder rtsp://192.168.1.21/live</translation>
    </message>
    <message>
        <source>looking …</source>
        <translation>wird angesehen …</translation>
    </message>
    <message>
        <source>{title} is in the list already.</source>
        <translation>{title} steht schon in der Liste.</translation>
    </message>
    <message numerus="yes">
        <source>Open {n} camera</source>
        <comment>Open {n} cameras</comment>
        <translation>
            <numerusform>{n} Kamera öffnen</numerusform>
            <numerusform>{n} Kameras öffnen</numerusform>
        </translation>
    </message>
    <message>
        <source>{rate:.0f} frames/s come.</source>
        <translation>{rate:.0f} Bilder/s kommen an.</translation>
    </message>
    <message>
        <source>Two cameras are called {doubled}. Give each a name of its own.</source>
        <translation>Zwei Kameras heißen {doubled}. Jeder einen eigenen Namen geben.</translation>
    </message>
    <message>
        <source>Choose a camera, or add a film.</source>
        <translation>Eine Kamera auswählen oder einen Film hinzufügen.</translation>
    </message>
    <message>
        <source>beside the recording</source>
        <translation>neben der Aufnahme</translation>
    </message>
    <message>
        <source>General</source>
        <translation>Allgemein</translation>
    </message>
    <message>
        <source>Reset all</source>
        <translation>Alles zurücksetzen</translation>
    </message>
    <message>
        <source>Forget layout, last rig, switches, folders and keys.</source>
        <translation>Anordnung, letztes Rig, Schalter, Ordner und Tasten vergessen.</translation>
    </message>
    <message>
        <source>Every change holds already.</source>
        <translation>Jede Änderung gilt bereits.</translation>
    </message>
    <message>
        <source>The file in which the app remembers all this.</source>
        <translation>Die Datei, in der sich die App das alles merkt.</translation>
    </message>
    <message>
        <source>Light text on dark ground, or the other way round. The View menu has it, too.</source>
        <translation>Heller Text auf dunklem Grund oder umgekehrt. Auch im Menü Ansicht.</translation>
    </message>
    <message>
        <source>The language of the windows, from the next start on.</source>
        <translation>Die Sprache der Fenster, vom nächsten Start an.</translation>
    </message>
    <message>
        <source>As the desktop</source>
        <translation>Wie der Desktop</translation>
    </message>
    <message>
        <source>What the app opens when it starts without a rig. An engine that runs already comes first.</source>
        <translation>Was die App öffnet, wenn sie ohne Rig startet. Eine Engine, die schon läuft, geht vor.</translation>
    </message>
    <message>
        <source>Show what to do next when cameras of this computer are opened</source>
        <translation>Die nächsten Schritte zeigen, wenn Kameras dieses Rechners geöffnet werden</translation>
    </message>
    <message>
        <source>Where recordings are made and listed.</source>
        <translation>Wo Aufnahmen angelegt und aufgelistet werden.</translation>
    </message>
    <message>
        <source>Where exported files are offered to be written.</source>
        <translation>Wo exportierte Dateien gespeichert werden sollen.</translation>
    </message>
    <message>
        <source>Look</source>
        <translation>Aussehen</translation>
    </message>
    <message>
        <source>Language</source>
        <translation>Sprache</translation>
    </message>
    <message>
        <source>At the start, open</source>
        <translation>Beim Start öffnen</translation>
    </message>
    <message>
        <source>Recordings</source>
        <translation>Aufnahmen</translation>
    </message>
    <message>
        <source>Exported files</source>
        <translation>Exportierte Dateien</translation>
    </message>
    <message>
        <source>From the next start on.</source>
        <translation>Gilt vom nächsten Start an.</translation>
    </message>
    <message>
        <source>as recorded</source>
        <translation>wie aufgenommen</translation>
    </message>
    <message>
        <source>leave gaps</source>
        <translation>Lücken lassen</translation>
    </message>
    <message>
        <source>classic</source>
        <translation>klassisch</translation>
    </message>
    <message>
        <source>estimator</source>
        <translation>Schätzer</translation>
    </message>
    <message>
        <source>rig</source>
        <translation>Rig</translation>
    </message>
    <message>
        <source>wrist, along the palm&apos;s axes</source>
        <translation>Handgelenk, entlang der Achsen der Handfläche</translation>
    </message>
    <message>
        <source>Export recording</source>
        <translation>Aufnahme exportieren</translation>
    </message>
    <message>
        <source>Choose …</source>
        <translation>Auswählen …</translation>
    </message>
    <message>
        <source>Another recording (.rhotlog).</source>
        <translation>Eine andere Aufnahme (.rhotlog).</translation>
    </message>
    <message>
        <source>Which programs shall read it.</source>
        <translation>Welche Programme sie lesen sollen.</translation>
    </message>
    <message>
        <source>Which tracker makes a hand of the recorded datagrams.</source>
        <translation>Welcher Tracker aus den aufgenommenen Datagrammen eine Hand macht.</translation>
    </message>
    <message>
        <source>Where positions are told: in the rig frame, or relative to the wrist joint.</source>
        <translation>Worin Positionen angegeben werden: im Rig-Koordinatensystem oder relativ zum Handgelenk.</translation>
    </message>
    <message>
        <source>Unit of length, where the format leaves a choice.</source>
        <translation>Längeneinheit, wo das Format die Wahl lässt.</translation>
    </message>
    <message>
        <source>Smooth</source>
        <translation>Glätten</translation>
    </message>
    <message>
        <source>Every state uses what came after it as well. Only the estimator can.</source>
        <translation>Jeder Zustand nutzt auch, was nach ihm kam. Nur der Schätzer kann das.</translation>
    </message>
    <message>
        <source>States at equal intervals. As recorded each keeps its own time, and formats that have a rate get the cameras&apos;.</source>
        <translation>Zustände in gleichen Abständen. Wie aufgenommen behält jeder seine Zeit, und Formate mit einer Rate erhalten die der Kameras.</translation>
    </message>
    <message>
        <source>Gaps up to this length are interpolated. What is filled in is marked: by its knowledge, or in a table beside the file where the format has none.</source>
        <translation>Lücken bis zu dieser Länge werden interpoliert. Gefülltes ist gekennzeichnet: durch seine Kenntnis oder, wo das Format keine hat, in einer Tabelle neben der Datei.</translation>
    </message>
    <message>
        <source>The first fingertips as they would be written; the file holds much more.</source>
        <translation>Die ersten Fingerspitzen, wie sie geschrieben würden; die Datei enthält viel mehr.</translation>
    </message>
    <message>
        <source>Export …</source>
        <translation>Exportieren …</translation>
    </message>
    <message>
        <source>Choose a file; it appears when it is whole.</source>
        <translation>Eine Datei auswählen; sie erscheint, wenn sie vollständig ist.</translation>
    </message>
    <message>
        <source>Recording</source>
        <translation>Aufnahme</translation>
    </message>
    <message>
        <source>Format</source>
        <translation>Format</translation>
    </message>
    <message>
        <source>Tracker</source>
        <translation>Tracker</translation>
    </message>
    <message>
        <source>Rate</source>
        <translation>Rate</translation>
    </message>
    <message>
        <source>Fill gaps up to</source>
        <translation>Lücken füllen bis</translation>
    </message>
    <message>
        <source>Positions in</source>
        <translation>Positionen in</translation>
    </message>
    <message>
        <source>Lengths in</source>
        <translation>Längen in</translation>
    </message>
    <message>
        <source>, tracked as shown</source>
        <translation>, verfolgt wie gezeigt</translation>
    </message>
    <message>
        <source>Choose a recording.</source>
        <translation>Eine Aufnahme auswählen.</translation>
    </message>
    <message>
        <source>Choose a recording</source>
        <translation>Eine Aufnahme auswählen</translation>
    </message>
    <message>
        <source>Recordings (*.rhotlog *.log);;All files (*)</source>
        <translation>Aufnahmen (*.rhotlog *.log);;Alle Dateien (*)</translation>
    </message>
    <message>
        <source>Cancelled; nothing was written.</source>
        <translation>Abgebrochen; nichts wurde geschrieben.</translation>
    </message>
    <message>
        <source>Export to</source>
        <translation>Exportieren nach</translation>
    </message>
    <message>
        <source>{format} ({kinds});;All files (*)</source>
        <translation>{format} ({kinds});;Alle Dateien (*)</translation>
    </message>
    <message>
        <source>Exporting to {out} …</source>
        <translation>Export nach {out} …</translation>
    </message>
    <message>
        <source>Exported {states} states to {path}.</source>
        <translation>{states} Zustände nach {path} exportiert.</translation>
    </message>
    <message>
        <source>Not all of the recording could be read: {loss}.</source>
        <translation>Nicht die ganze Aufnahme war lesbar: {loss}.</translation>
    </message>
    <message>
        <source>Another folder.</source>
        <translation>Ein anderer Ordner.</translation>
    </message>
    <message>
        <source>As at first</source>
        <translation>Wie anfangs</translation>
    </message>
    <message>
        <source>The folder that it was on the first start.</source>
        <translation>Der Ordner, der es beim ersten Start war.</translation>
    </message>
    <message>
        <source>Action</source>
        <translation>Aktion</translation>
    </message>
    <message>
        <source>Key</source>
        <translation>Taste</translation>
    </message>
    <message>
        <source>Keys of all actions</source>
        <translation>Tasten aller Aktionen</translation>
    </message>
    <message>
        <source>Press the new key here; the cross takes the key away.</source>
        <translation>Hier die neue Taste drücken; das Kreuz nimmt die Taste weg.</translation>
    </message>
    <message>
        <source>The key that the action had on the first start.</source>
        <translation>Die Taste, die die Aktion beim ersten Start hatte.</translation>
    </message>
    <message>
        <source>Key of the selected action</source>
        <translation>Taste der ausgewählten Aktion</translation>
    </message>
    <message>
        <source>Space starts and stops always. Windows beside the main one have keys of their own; the guide lists them.</source>
        <translation>Die Leertaste startet und stoppt immer. Fenster neben dem Hauptfenster haben eigene Tasten; die Anleitung führt sie auf.</translation>
    </message>
    <message>
        <source>Plots</source>
        <translation>Diagramme</translation>
    </message>
    <message>
        <source>This rig has no file, so nothing is kept: it can be brought back here, until this window closes.</source>
        <translation>Dieses Rig hat keine Datei, es wird also nichts aufbewahrt: Es lässt sich hier zurückholen, bis dieses Fenster schließt.</translation>
    </message>
    <message>
        <source>What is in the rig file now is kept, and can be brought back at any time with Calibrate, Bring back an earlier calibration.</source>
        <translation>Was jetzt in der Rig-Datei steht, bleibt erhalten und lässt sich jederzeit mit Kalibrieren, Frühere Kalibrierung zurückholen wiederherstellen.</translation>
    </message>
    <message>
        <source>Nothing changes.</source>
        <translation>Nichts ändert sich.</translation>
    </message>
    <message>
        <source>{title}. Then the engine changes over.</source>
        <translation>{title}. Dann stellt sich die Engine um.</translation>
    </message>
    <message>
        <source>Outputs</source>
        <translation>Ausgaben</translation>
    </message>
    <message>
        <source>Add</source>
        <translation>Hinzufügen</translation>
    </message>
    <message>
        <source>Undo</source>
        <translation>Rückgängig</translation>
    </message>
    <message>
        <source>Which protocol the other program understands.</source>
        <translation>Welches Protokoll das andere Programm versteht.</translation>
    </message>
    <message>
        <source>The joint set: which joints, in whose order and axes.</source>
        <translation>Der Gelenksatz: welche Gelenke, in welcher Reihenfolge und welchen Achsen.</translation>
    </message>
    <message>
        <source> states/s</source>
        <translation> Zustände/s</translation>
    </message>
    <message>
        <source>every state</source>
        <translation>jeder Zustand</translation>
    </message>
    <message>
        <source>At most so many states per second; at the lowest value every state is sent.</source>
        <translation>Höchstens so viele Zustände pro Sekunde; beim kleinsten Wert wird jeder gesendet.</translation>
    </message>
    <message>
        <source>Take the last change back (Ctrl+Z).</source>
        <translation>Die letzte Änderung zurücknehmen (Strg+Z).</translation>
    </message>
    <message>
        <source>Added {output}.</source>
        <translation>{output} hinzugefügt.</translation>
    </message>
    <message>
        <source>Changed to {output}.</source>
        <translation>Geändert in {output}.</translation>
    </message>
    <message>
        <source>{output} is on.</source>
        <translation>{output} ist an.</translation>
    </message>
    <message>
        <source>{output} is off.</source>
        <translation>{output} ist aus.</translation>
    </message>
    <message>
        <source>Removed {output}.</source>
        <translation>{output} entfernt.</translation>
    </message>
    <message>
        <source>Taken back.</source>
        <translation>Zurückgenommen.</translation>
    </message>
    <message>
        <source>The engine changes over …</source>
        <translation>Die Engine stellt sich um …</translation>
    </message>
    <message>
        <source>Change {output}</source>
        <translation>{output} ändern</translation>
    </message>
    <message>
        <source>Change</source>
        <translation>Ändern</translation>
    </message>
    <message>
        <source>Add a stream</source>
        <translation>Einen Datenstrom hinzufügen</translation>
    </message>
    <message>
        <source>It opens at once; tracking goes on.</source>
        <translation>Er öffnet sofort; die Verfolgung läuft weiter.</translation>
    </message>
    <message>
        <source>{meaning} Target: {target}</source>
        <translation>{meaning} Ziel: {target}</translation>
    </message>
    <message>
        <source>never arrived: the network lost them</source>
        <translation>nie angekommen: im Netz verloren</translation>
    </message>
    <message>
        <source>came too late: this computer or the network is busy</source>
        <translation>zu spät gekommen: dieser Rechner oder das Netz ist ausgelastet</translation>
    </message>
    <message>
        <source>could not be read in time: this computer is busy</source>
        <translation>nicht rechtzeitig gelesen: dieser Rechner ist ausgelastet</translation>
    </message>
    <message>
        <source>of another marker set than the rig&apos;s</source>
        <translation>von einem anderen Markersatz als dem des Rigs</translation>
    </message>
    <message>
        <source>landmarks, but no marker of the rig is one</source>
        <translation>Landmarken, aber kein Marker des Rigs ist eine</translation>
    </message>
    <message>
        <source>of another picture size than the rig&apos;s</source>
        <translation>von einer anderen Bildgröße als der des Rigs</translation>
    </message>
    <message>
        <source>of another node</source>
        <translation>von einem anderen Knoten</translation>
    </message>
    <message>
        <source>came twice</source>
        <translation>doppelt gekommen</translation>
    </message>
    <message>
        <source>an observation kind failed over them</source>
        <translation>an ihnen scheiterte eine Beobachtungsart</translation>
    </message>
    <message>
        <source>not signed with the node&apos;s key</source>
        <translation>nicht mit dem Schlüssel des Knotens signiert</translation>
    </message>
    <message>
        <source>not signed</source>
        <translation>nicht signiert</translation>
    </message>
    <message numerus="yes">
        <source>{n} frame unused</source>
        <comment>{n} frames unused</comment>
        <translation>
            <numerusform>{n} Bild ungenutzt</numerusform>
            <numerusform>{n} Bilder ungenutzt</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>{n} frame received.</source>
        <comment>{n} frames received.</comment>
        <translation>
            <numerusform>{n} Bild empfangen.</numerusform>
            <numerusform>{n} Bilder empfangen.</numerusform>
        </translation>
    </message>
    <message>
        <source>Unused:</source>
        <translation>Ungenutzt:</translation>
    </message>
    <message>
        <source>refused ({reason})</source>
        <translation>abgelehnt ({reason})</translation>
    </message>
    <message>
        <source>Sends the thesis&apos;s text datagrams: untrusted.</source>
        <translation>Sendet die Text-Datagramme der Arbeit: nicht vertrauenswürdig.</translation>
    </message>
    <message>
        <source>Not paired: untrusted; anybody on the network may steer it or speak in its place.</source>
        <translation>Nicht gekoppelt: nicht vertrauenswürdig; jeder im Netz kann ihn steuern oder sich für ihn ausgeben.</translation>
    </message>
    <message>
        <source>no clock (text)</source>
        <translation>keine Uhr (Text)</translation>
    </message>
    <message>
        <source>clock unknown</source>
        <translation>Uhr unbekannt</translation>
    </message>
    <message>
        <source>clock ± {bound:.2f} ms</source>
        <translation>Uhr ± {bound:.2f} ms</translation>
    </message>
    <message>
        <source>± {spread} mm (one sigma)</source>
        <translation>± {spread} mm (ein Sigma)</translation>
    </message>
    <message>
        <source>At least: {reason}</source>
        <translation>Mindestens: {reason}</translation>
    </message>
    <message>
        <source>epipolar error {error:.2f} px</source>
        <translation>Epipolarfehler {error:.2f} px</translation>
    </message>
    <message>
        <source>IDLE</source>
        <translation>RUHT</translation>
    </message>
    <message>
        <source>Nothing is running. Press Start to begin.</source>
        <translation>Nichts läuft. Start drücken, um zu beginnen.</translation>
    </message>
    <message>
        <source>SEARCHING</source>
        <translation>SUCHT</translation>
    </message>
    <message>
        <source>The nodes stream, but the hand has not been found yet.</source>
        <translation>Die Knoten senden, aber die Hand ist noch nicht gefunden.</translation>
    </message>
    <message>
        <source>TRACKING</source>
        <translation>VERFOLGT</translation>
    </message>
    <message>
        <source>The hand is tracked, and its markers, landmarks or contours are seen by enough cameras.</source>
        <translation>Die Hand wird verfolgt, und genügend Kameras sehen ihre Marker, Landmarken oder Konturen.</translation>
    </message>
    <message>
        <source>PARTIAL</source>
        <translation>TEILWEISE</translation>
    </message>
    <message>
        <source>The hand is tracked, but some of its markers, landmarks or contours are not seen by enough cameras.</source>
        <translation>Die Hand wird verfolgt, aber einige ihrer Marker, Landmarken oder Konturen werden von zu wenigen Kameras gesehen.</translation>
    </message>
    <message>
        <source>LOST</source>
        <translation>VERLOREN</translation>
    </message>
    <message>
        <source>The hand was tracked and is out of sight now.</source>
        <translation>Die Hand wurde verfolgt und ist jetzt außer Sicht.</translation>
    </message>
    <message>
        <source>FAULT</source>
        <translation>FEHLER</translation>
    </message>
    <message>
        <source>Something is broken; the sentence below says what.</source>
        <translation>Etwas ist defekt; die Meldung unten sagt, was.</translation>
    </message>
    <message>
        <source>NO RIG</source>
        <translation>KEIN RIG</translation>
    </message>
    <message>
        <source>No rig is open. Choose one to begin.</source>
        <translation>Kein Rig ist geöffnet. Eines auswählen, um zu beginnen.</translation>
    </message>
    <message>
        <source>STARTING</source>
        <translation>STARTET</translation>
    </message>
    <message>
        <source>The engine is starting.</source>
        <translation>Die Engine startet.</translation>
    </message>
    <message>
        <source>NO ENGINE</source>
        <translation>KEINE ENGINE</translation>
    </message>
    <message>
        <source>The engine does not answer. The app is starting it again.</source>
        <translation>Die Engine antwortet nicht. Die App startet sie neu.</translation>
    </message>
    <message>
        <source>This state is not known to this version.</source>
        <translation>Diese Version kennt diesen Zustand nicht.</translation>
    </message>
    <message>
        <source>silent</source>
        <translation>stumm</translation>
    </message>
    <message>
        <source>Nothing has been heard from this node for a second.</source>
        <translation>Seit einer Sekunde war von diesem Knoten nichts zu hören.</translation>
    </message>
    <message>
        <source>starting</source>
        <translation>startet</translation>
    </message>
    <message>
        <source>The node is opening its camera.</source>
        <translation>Der Knoten öffnet seine Kamera.</translation>
    </message>
    <message>
        <source>ready</source>
        <translation>bereit</translation>
    </message>
    <message>
        <source>The node waits for the start message.</source>
        <translation>Der Knoten wartet auf das Startsignal.</translation>
    </message>
    <message>
        <source>streaming</source>
        <translation>sendet</translation>
    </message>
    <message>
        <source>The node sends what it sees.</source>
        <translation>Der Knoten sendet, was er sieht.</translation>
    </message>
    <message>
        <source>fault</source>
        <translation>Fehler</translation>
    </message>
    <message>
        <source>The node reports that something is broken.</source>
        <translation>Der Knoten meldet, dass etwas defekt ist.</translation>
    </message>
    <message>
        <source>measured</source>
        <translation>gemessen</translation>
    </message>
    <message>
        <source>Seen by enough cameras at this instant. Drawn solid.</source>
        <translation>In diesem Augenblick von genügend Kameras gesehen. Voll gezeichnet.</translation>
    </message>
    <message>
        <source>inferred</source>
        <translation>abgeleitet</translation>
    </message>
    <message>
        <source>Follows from what is measured through the hand model, or from a half-hidden sight. Drawn translucent.</source>
        <translation>Folgt über das Handmodell aus dem Gemessenen oder aus einem halb verdeckten Anblick. Durchscheinend gezeichnet.</translation>
    </message>
    <message>
        <source>guessed</source>
        <translation>geraten</translation>
    </message>
    <message>
        <source>The images do not determine it: the last or the most natural value. Drawn hatched.</source>
        <translation>Die Bilder bestimmen es nicht: der letzte oder der natürlichste Wert. Schraffiert gezeichnet.</translation>
    </message>
    <message>
        <source>unknown</source>
        <translation>unbekannt</translation>
    </message>
    <message>
        <source>Nothing is known. Not drawn.</source>
        <translation>Nichts ist bekannt. Nicht gezeichnet.</translation>
    </message>
    <message>
        <source>detect</source>
        <translation>Erkennen</translation>
    </message>
    <message>
        <source>network</source>
        <translation>Netz</translation>
    </message>
    <message>
        <source>pair</source>
        <translation>Paaren</translation>
    </message>
    <message>
        <source>triangulate</source>
        <translation>Triangulieren</translation>
    </message>
    <message>
        <source>filter</source>
        <translation>Filtern</translation>
    </message>
    <message>
        <source>solve</source>
        <translation>Lösen</translation>
    </message>
    <message>
        <source>publish</source>
        <translation>Ausgeben</translation>
    </message>
    <message>
        <source>receive to state</source>
        <translation>Empfang bis Zustand</translation>
    </message>
    <message>
        <source>ok</source>
        <translation>ok</translation>
    </message>
    <message>
        <source>Seen by every camera.</source>
        <translation>Von jeder Kamera gesehen.</translation>
    </message>
    <message>
        <source>half hidden</source>
        <translation>halb verdeckt</translation>
    </message>
    <message>
        <source>A camera sees only a part of it; its place is less certain.</source>
        <translation>Eine Kamera sieht nur einen Teil davon; der Ort ist weniger sicher.</translation>
    </message>
    <message>
        <source>ambiguous</source>
        <translation>mehrdeutig</translation>
    </message>
    <message>
        <source>Another spot of the same colour is as plausible.</source>
        <translation>Ein anderer Fleck derselben Farbe ist ebenso plausibel.</translation>
    </message>
    <message>
        <source>lost</source>
        <translation>verloren</translation>
    </message>
    <message>
        <source>No camera sees it.</source>
        <translation>Keine Kamera sieht ihn.</translation>
    </message>
    <message>
        <source>{names} only</source>
        <translation>nur {names}</translation>
    </message>
    <message>
        <source>Not every camera sees it, so its depth is not measured.</source>
        <translation>Nicht jede Kamera sieht ihn, daher ist seine Tiefe nicht gemessen.</translation>
    </message>
    <message>
        <source>The state of the whole rig in one word: IDLE, SEARCHING, TRACKING, PARTIAL, LOST or FAULT.</source>
        <translation>Der Zustand des ganzen Rigs in einem Wort: RUHT, SUCHT, VERFOLGT, TEILWEISE, VERLOREN oder FEHLER.</translation>
    </message>
    <message>
        <source>How many hand states per second the engine publishes.</source>
        <translation>Wie viele Handzustände die Engine pro Sekunde ausgibt.</translation>
    </message>
    <message>
        <source>The rig file: cameras, lenses, marker set, hand and filters.</source>
        <translation>Die Rig-Datei: Kameras, Objektive, Markersatz, Hand und Filter.</translation>
    </message>
    <message>
        <source>A small computer with a camera. It finds the markers in its picture and sends their places.</source>
        <translation>Ein kleiner Rechner mit einer Kamera. Er findet die Marker in seinem Bild und sendet ihre Orte.</translation>
    </message>
    <message>
        <source>Frames per second that arrive from this node.</source>
        <translation>Bilder pro Sekunde, die von diesem Knoten ankommen.</translation>
    </message>
    <message>
        <source>Frames that were not used since the start, shown when they are more than one in a hundred. The hint of the card says why.</source>
        <translation>Bilder, die seit dem Start nicht genutzt wurden; gezeigt, wenn es mehr als eines von hundert ist. Der Hinweis der Karte sagt, warum.</translation>
    </message>
    <message>
        <source>Datagrams that arrived and were rejected, with the reason.</source>
        <translation>Datagramme, die ankamen und abgelehnt wurden, mit dem Grund.</translation>
    </message>
    <message>
        <source>How well the node&apos;s clock is known: the true offset lies within this bound of the estimate. 1 ms at 1 m/s is 1 mm.</source>
        <translation>Wie gut die Uhr des Knotens bekannt ist: Der wahre Versatz liegt innerhalb dieser Grenze um die Schätzung. 1 ms ist bei 1 m/s 1 mm.</translation>
    </message>
    <message>
        <source>A coloured spot on the hand: five painted fingertips and a wrist band.</source>
        <translation>Ein farbiger Fleck an der Hand: fünf bemalte Fingerspitzen und ein Armband.</translation>
    </message>
    <message>
        <source>How much a marker trembles: rms over the last second of its raw position, motion removed by third differences. It includes depth, which is the noisiest direction. There is no figure below about ten states per second.</source>
        <translation>Wie stark ein Marker zittert: Effektivwert seines rohen Orts über die letzte Sekunde, ohne Bewegung (dritte Differenzen). Enthält die Tiefe, die am stärksten rauscht. Unter etwa zehn Zuständen pro Sekunde gibt es keinen Wert.</translation>
    </message>
    <message>
        <source>How long each stage took for one state: median (p50) and 99th percentile (p99) of the last two seconds. Bands are stacked medians; the lines are the whole way of each state.</source>
        <translation>Wie lange jede Stufe für einen Zustand brauchte: Median (p50) und 99. Perzentil (p99) der letzten zwei Sekunden. Bänder sind gestapelte Mediane; die Linien sind der ganze Weg jedes Zustands.</translation>
    </message>
    <message>
        <source>11.1 ms is one frame at 90 fps, the rate the thesis aims at.</source>
        <translation>11.1 ms ist ein Bild bei 90 Bildern pro Sekunde, dem Ziel der Arbeit.</translation>
    </message>
    <message>
        <source>From the frame being available on the node to the datagram being sent.</source>
        <translation>Von der Verfügbarkeit des Bildes auf dem Knoten bis zum Senden des Datagramms.</translation>
    </message>
    <message>
        <source>From the node&apos;s send to the receive time of the master&apos;s kernel, by the estimated clocks.</source>
        <translation>Vom Senden des Knotens bis zum Empfang im Kernel des Masters, nach den geschätzten Uhren.</translation>
    </message>
    <message>
        <source>Waiting until both cameras have seen a time after the state&apos;s instant.</source>
        <translation>Warten, bis beide Kameras eine Zeit nach dem Augenblick des Zustands gesehen haben.</translation>
    </message>
    <message>
        <source>From two pixels to a point in space.</source>
        <translation>Von zwei Bildpunkten zu einem Punkt im Raum.</translation>
    </message>
    <message>
        <source>The 1-euro filter before and after depth.</source>
        <translation>Der 1-Euro-Filter vor und nach der Tiefe.</translation>
    </message>
    <message>
        <source>From points to the hand&apos;s joints.</source>
        <translation>Von Punkten zu den Gelenken der Hand.</translation>
    </message>
    <message>
        <source>From the finished state to the clients.</source>
        <translation>Vom fertigen Zustand zu den Empfängern.</translation>
    </message>
    <message>
        <source>States per second and frames per second of each node; bars show lost datagrams per second.</source>
        <translation>Zustände pro Sekunde und Bilder pro Sekunde jedes Knotens; Balken zeigen verlorene Datagramme pro Sekunde.</translation>
    </message>
    <message>
        <source>How far the fingertips of the two runs are apart at the same instant, in mm. p50 and p95 are over the whole recording.</source>
        <translation>Wie weit die Fingerspitzen der beiden Läufe im selben Augenblick auseinanderliegen, in mm. p50 und p95 gelten für die ganze Aufnahme.</translation>
    </message>
    <message>
        <source>Bending towards the palm, in degrees; 0 is a straight finger.</source>
        <translation>Beugung zur Handfläche, in Grad; 0 ist ein gestreckter Finger.</translation>
    </message>
    <message>
        <source>Spreading towards the thumb&apos;s side, in degrees.</source>
        <translation>Spreizung zur Daumenseite, in Grad.</translation>
    </message>
    <message>
        <source>Carpometacarpal joint: the thumb&apos;s base, at the wrist.</source>
        <translation>Karpometakarpalgelenk: das Sattelgelenk des Daumens am Handgelenk.</translation>
    </message>
    <message>
        <source>Metacarpophalangeal joint: the knuckle.</source>
        <translation>Metakarpophalangealgelenk: der Knöchel.</translation>
    </message>
    <message>
        <source>Proximal interphalangeal joint: the middle joint of a finger.</source>
        <translation>Proximales Interphalangealgelenk: das Mittelgelenk eines Fingers.</translation>
    </message>
    <message>
        <source>Distal interphalangeal joint: the last joint of a finger.</source>
        <translation>Distales Interphalangealgelenk: das letzte Gelenk eines Fingers.</translation>
    </message>
    <message>
        <source>Interphalangeal joint: the last joint of the thumb.</source>
        <translation>Interphalangealgelenk: das letzte Gelenk des Daumens.</translation>
    </message>
    <message>
        <source>An ellipsoid of three sigma holds the true place with 97 % probability.</source>
        <translation>Ein Ellipsoid von drei Sigma enthält den wahren Ort mit 97 % Wahrscheinlichkeit.</translation>
    </message>
    <message>
        <source>Standard deviation (one sigma) of the place along the axis in which it is known worst, in mm.</source>
        <translation>Standardabweichung (ein Sigma) des Orts entlang der Achse, in der er am schlechtesten bekannt ist, in mm.</translation>
    </message>
    <message>
        <source>How well the palm&apos;s place and turn are known: standard deviations along the worst axes.</source>
        <translation>Wie gut Ort und Drehung der Handfläche bekannt sind: Standardabweichungen entlang der schlechtesten Achsen.</translation>
    </message>
    <message>
        <source>Estimated size of the hand as a factor on every length of the rig&apos;s hand (Calibrate, Tracker).</source>
        <translation>Geschätzte Größe der Hand als Faktor auf jede Länge der Hand des Rigs (Kalibrieren, Tracker).</translation>
    </message>
    <message>
        <source>How far the two cameras&apos; rays miss each other, in pixels. Above one pixel, check calibration.</source>
        <translation>Wie weit die Strahlen der beiden Kameras einander verfehlen, in Pixeln. Bei mehr als einem Pixel die Kalibrierung prüfen.</translation>
    </message>
    <message>
        <source>thumb</source>
        <translation>Daumen</translation>
    </message>
    <message>
        <source>index</source>
        <translation>Zeigefinger</translation>
    </message>
    <message>
        <source>middle</source>
        <translation>Mittelfinger</translation>
    </message>
    <message>
        <source>ring</source>
        <translation>Ringfinger</translation>
    </message>
    <message>
        <source>little</source>
        <translation>Kleinfinger</translation>
    </message>
    <message>
        <source>wrist</source>
        <translation>Handgelenk</translation>
    </message>
    <message>
        <source>thumb tip</source>
        <translation>Daumenspitze</translation>
    </message>
    <message>
        <source>index tip</source>
        <translation>Zeigefingerspitze</translation>
    </message>
    <message>
        <source>middle tip</source>
        <translation>Mittelfingerspitze</translation>
    </message>
    <message>
        <source>ring tip</source>
        <translation>Ringfingerspitze</translation>
    </message>
    <message>
        <source>little tip</source>
        <translation>Kleinfingerspitze</translation>
    </message>
    <message>
        <source>left</source>
        <translation>links</translation>
    </message>
    <message>
        <source>right</source>
        <translation>rechts</translation>
    </message>
    <message>
        <source>red</source>
        <translation>rot</translation>
    </message>
    <message>
        <source>green</source>
        <translation>grün</translation>
    </message>
    <message>
        <source>blue</source>
        <translation>blau</translation>
    </message>
    <message>
        <source>yellow</source>
        <translation>gelb</translation>
    </message>
    <message>
        <source>magenta</source>
        <translation>magenta</translation>
    </message>
    <message>
        <source>cyan</source>
        <translation>cyan</translation>
    </message>
    <message>
        <source>orange</source>
        <translation>orange</translation>
    </message>
    <message>
        <source>white</source>
        <translation>weiß</translation>
    </message>
    <message>
        <source>black</source>
        <translation>schwarz</translation>
    </message>
    <message>
        <source>free</source>
        <translation>frei</translation>
    </message>
    <message>
        <source>disc</source>
        <translation>Scheibe</translation>
    </message>
    <message>
        <source>sphere</source>
        <translation>Kugel</translation>
    </message>
    <message>
        <source>capsule</source>
        <translation>Kapsel</translation>
    </message>
    <message>
        <source>band</source>
        <translation>Band</translation>
    </message>
    <message>
        <source>blob</source>
        <translation>Fleck</translation>
    </message>
    <message>
        <source>landmark</source>
        <translation>Landmarke</translation>
    </message>
    <message>
        <source>skin</source>
        <translation>Haut</translation>
    </message>
    <message>
        <source>squares</source>
        <translation>Felder</translation>
    </message>
    <message>
        <source>tags</source>
        <translation>Tags</translation>
    </message>
    <message>
        <source>spacings</source>
        <translation>Abstände</translation>
    </message>
    <message>
        <source>left hand</source>
        <translation>linke Hand</translation>
    </message>
    <message>
        <source>right hand</source>
        <translation>rechte Hand</translation>
    </message>
    <message>
        <source>first left hand</source>
        <translation>erste linke Hand</translation>
    </message>
    <message>
        <source>other left hand</source>
        <translation>andere linke Hand</translation>
    </message>
    <message>
        <source>first right hand</source>
        <translation>erste rechte Hand</translation>
    </message>
    <message>
        <source>other right hand</source>
        <translation>andere rechte Hand</translation>
    </message>
    <message>
        <source>Classic</source>
        <translation>Klassisch</translation>
    </message>
    <message>
        <source>The thesis&apos;s way: triangulate each marker, smooth it, then bend the fingers one by one. Works with every rig. A marker needs two cameras, and joints do not say how well they are known.</source>
        <translation>Der Weg der Arbeit: jeden Marker triangulieren, glätten, dann die Finger einzeln beugen. Geht mit jedem Rig. Ein Marker braucht zwei Kameras, und die Gelenke sagen nicht, wie gut sie bekannt sind.</translation>
    </message>
    <message>
        <source>Estimator</source>
        <translation>Schätzer</translation>
    </message>
    <message>
        <source>One hand estimated from everything that every camera sees, at the time it was seen. A marker that one camera sees counts, hidden fingers are carried on, and every joint says how well it is known. It predicts, and smooths recordings. Needs calibrated cameras with clocks.</source>
        <translation>Eine Hand, geschätzt aus allem, was jede Kamera sieht, zu der Zeit, zu der sie es sah. Auch ein Marker, den nur eine Kamera sieht, zählt; verdeckte Finger werden fortgeführt, und jedes Gelenk sagt, wie gut es bekannt ist. Sagt voraus und glättet Aufnahmen. Braucht kalibrierte Kameras mit Uhren.</translation>
    </message>
    <message>
        <source>FABRIK, allowing for noise</source>
        <translation>FABRIK, rauschbewusst</translation>
    </message>
    <message>
        <source>FABRIK, then a descent to the natural pose. The default.</source>
        <translation>FABRIK, dann ein Abstieg zur natürlichen Pose. Der Standard.</translation>
    </message>
    <message>
        <source>Jacobian transpose</source>
        <translation>transponierte Jacobi-Matrix</translation>
    </message>
    <message>
        <source>Equation 2.13. Slow where a finger is nearly straight.</source>
        <translation>Gleichung 2.13. Langsam, wo ein Finger fast gestreckt ist.</translation>
    </message>
    <message>
        <source>pseudo-inverse</source>
        <translation>Pseudoinverse</translation>
    </message>
    <message>
        <source>Equation 2.16. Jumps near a straight finger.</source>
        <translation>Gleichung 2.16. Springt nahe einem gestreckten Finger.</translation>
    </message>
    <message>
        <source>singular values</source>
        <translation>Singulärwerte</translation>
    </message>
    <message>
        <source>Equation 2.20: the pseudo-inverse without its small singular values.</source>
        <translation>Gleichung 2.20: die Pseudoinverse ohne ihre kleinen Singulärwerte.</translation>
    </message>
    <message>
        <source>damped least squares</source>
        <translation>gedämpfte kleinste Quadrate</translation>
    </message>
    <message>
        <source>Equation 2.23.</source>
        <translation>Gleichung 2.23.</translation>
    </message>
    <message>
        <source>Newton</source>
        <translation>Newton</translation>
    </message>
    <message>
        <source>Equation 2.24, with the exact second derivatives.</source>
        <translation>Gleichung 2.24, mit den genauen zweiten Ableitungen.</translation>
    </message>
    <message>
        <source>Levenberg-Marquardt</source>
        <translation>Levenberg-Marquardt</translation>
    </message>
    <message>
        <source>Damped Gauss-Newton steps within the limits.</source>
        <translation>Gedämpfte Gauß-Newton-Schritte innerhalb der Grenzen.</translation>
    </message>
    <message>
        <source>closed form</source>
        <translation>geschlossene Form</translation>
    </message>
    <message>
        <source>Equation 2.4: the last two joints bend together, DIP = 2/3 PIP.</source>
        <translation>Gleichung 2.4: Die letzten beiden Gelenke beugen sich gemeinsam, DIP = 2/3 PIP.</translation>
    </message>
    <message>
        <source>full: every joint by itself</source>
        <translation>voll: jedes Gelenk für sich</translation>
    </message>
    <message>
        <source>27 degrees of freedom. The default.</source>
        <translation>27 Freiheitsgrade. Der Standard.</translation>
    </message>
    <message>
        <source>coupled: last joints follow</source>
        <translation>gekoppelt: letzte Gelenke folgen</translation>
    </message>
    <message>
        <source>DIP = 2/3 PIP, and the middle finger does not spread. Steadier with markers on the tips only; wrong for a fingertip that is pushed back.</source>
        <translation>DIP = 2/3 PIP, und der Mittelfinger spreizt sich nicht. Ruhiger mit Markern nur an den Spitzen; falsch bei einer Fingerspitze, die zurückgedrückt wird.</translation>
    </message>
    <message>
        <source>anatomical: what hands do</source>
        <translation>anatomisch: was Hände können</translation>
    </message>
    <message>
        <source>How far each joint goes in living hands. The default.</source>
        <translation>Wie weit jedes Gelenk bei lebenden Händen geht. Der Standard.</translation>
    </message>
    <message>
        <source>thesis: equation 2.1</source>
        <translation>Arbeit: Gleichung 2.1</translation>
    </message>
    <message>
        <source>The thesis&apos;s ranges, for comparing with it; some are too narrow for living hands.</source>
        <translation>Die Bereiche der Arbeit, zum Vergleich mit ihr; einige sind für lebende Hände zu eng.</translation>
    </message>
    <message>
        <source>Paint</source>
        <translation>Farbe</translation>
    </message>
    <message>
        <source>The painted markers of the rig&apos;s marker set.</source>
        <translation>Die bemalten Marker des Markersatzes des Rigs.</translation>
    </message>
    <message>
        <source>Landmarks</source>
        <translation>Landmarken</translation>
    </message>
    <message>
        <source>The joints that a detector finds on a bare hand, in the nodes or in another program. The rig&apos;s marker set is landmarks21 or another one with landmarks.</source>
        <translation>Die Gelenke, die ein Detektor an einer bloßen Hand findet, in den Knoten oder in einem anderen Programm. Der Markersatz des Rigs ist landmarks21 oder ein anderer mit Landmarken.</translation>
    </message>
    <message>
        <source>Contours</source>
        <translation>Konturen</translation>
    </message>
    <message>
        <source>No markers: the nodes search their pictures for the bare hand&apos;s edges. Calibrate, Background and skin comes first; then take the pose that the pictures show, and hold it.</source>
        <translation>Keine Marker: Die Knoten suchen in ihren Bildern die Kanten der bloßen Hand. Zuerst kommt Kalibrieren, Hintergrund und Haut; dann die Pose einnehmen, die die Bilder zeigen, und halten.</translation>
    </message>
    <message>
        <source>Paint and contours</source>
        <translation>Farbe und Konturen</translation>
    </message>
    <message>
        <source>The hand&apos;s edges beside its painted markers, such as two fingertips. Calibrate, Background and skin comes first here, too.</source>
        <translation>Die Kanten der Hand neben ihren bemalten Markern, etwa zwei Fingerspitzen. Auch hier kommt zuerst Kalibrieren, Hintergrund und Haut.</translation>
    </message>
    <message>
        <source>Landmarks and contours</source>
        <translation>Landmarken und Konturen</translation>
    </message>
    <message>
        <source>The bare hand&apos;s edges beside a detector&apos;s landmarks, which find the hand at once. Calibrate, Background and skin comes first here, too.</source>
        <translation>Die Kanten der bloßen Hand neben den Landmarken eines Detektors, die die Hand sofort finden. Auch hier kommt zuerst Kalibrieren, Hintergrund und Haut.</translation>
    </message>
    <message>
        <source>The rig&apos;s marker set has landmarks, no paint: they are tracked. Choose Landmarks to say so.</source>
        <translation>Der Markersatz des Rigs hat Landmarken, keine Farbe: Sie werden verfolgt. Landmarken auswählen, um es festzulegen.</translation>
    </message>
    <message>
        <source>The hand lies flat, as the 3-D mouse has it: only forefinger, thumb and little finger move. Where a board on the table has placed the rig, the palm slides on the table, and one camera suffices.</source>
        <translation>Die Hand liegt flach, wie für die 3-D-Maus: Nur Zeigefinger, Daumen und kleiner Finger bewegen sich. Wo ein Brett auf dem Tisch das Rig verortet hat, gleitet die Handfläche auf dem Tisch, und eine Kamera genügt.</translation>
    </message>
    <message>
        <source>The hand&apos;s size is estimated as it moves, so that a hand file that is some percent too large or too small does no harm. Open and close the hand for half a minute.</source>
        <translation>Die Größe der Hand wird geschätzt, während sie sich bewegt, sodass eine um einige Prozent zu große oder zu kleine Handdatei nicht schadet. Die Hand eine halbe Minute lang öffnen und schließen.</translation>
    </message>
    <message>
        <source>No size yet: start, and show the hand.</source>
        <translation>Noch keine Größe: starten und die Hand zeigen.</translation>
    </message>
    <message>
        <source>{scale_text} of the rig&apos;s hand: not certain yet. Open and close the hand, and turn it.</source>
        <translation>{scale_text} der Hand des Rigs: noch nicht sicher. Die Hand öffnen, schließen und drehen.</translation>
    </message>
    <message>
        <source>{scale_text} of the rig&apos;s hand: it fits ({before:.0f} mm from wrist to middle fingertip).</source>
        <translation>{scale_text} der Hand des Rigs: passt ({before:.0f} mm vom Handgelenk zur Mittelfingerspitze).</translation>
    </message>
    <message>
        <source>{scale_text} of the rig&apos;s hand: {after:.0f} mm long instead of {before:.0f} mm.</source>
        <translation>{scale_text} der Hand des Rigs: {after:.0f} mm lang statt {before:.0f} mm.</translation>
    </message>
    <message>
        <source>a moment left</source>
        <translation>gleich fertig</translation>
    </message>
    <message>
        <source>about {left:.0f} s left</source>
        <translation>noch etwa {left:.0f} s</translation>
    </message>
    <message>
        <source>about {left:.0f} min left</source>
        <translation>noch etwa {left:.0f} min</translation>
    </message>
    <message>
        <source>good</source>
        <translation>gut</translation>
    </message>
    <message>
        <source>May be used as it is.</source>
        <translation>Kann so benutzt werden.</translation>
    </message>
    <message>
        <source>usable</source>
        <translation>brauchbar</translation>
    </message>
    <message>
        <source>May be used; better is possible.</source>
        <translation>Kann benutzt werden; es geht besser.</translation>
    </message>
    <message>
        <source>not usable</source>
        <translation>unbrauchbar</translation>
    </message>
    <message>
        <source>Must not be used.</source>
        <translation>Darf nicht benutzt werden.</translation>
    </message>
    <message numerus="yes">
        <source>{n} &amp;more</source>
        <comment>{n} &amp;more</comment>
        <translation>
            <numerusform>{n} &amp;mehr</numerusform>
            <numerusform>{n} &amp;mehr</numerusform>
        </translation>
    </message>
    <message>
        <source>Advice</source>
        <translation>Meldungen</translation>
    </message>
    <message>
        <source>Take this pose with {hands}, and hold it</source>
        <translation>Diese Pose mit {hands} einnehmen und halten</translation>
    </message>
    <message>
        <source>Take this pose</source>
        <translation>Diese Pose einnehmen</translation>
    </message>
    <message>
        <source>the hand</source>
        <comment>Take this pose with the hand</comment>
        <translation>der Hand</translation>
    </message>
    <message>
        <source>Picture of camera {name}</source>
        <translation>Bild der Kamera {name}</translation>
    </message>
    <message>
        <source>Drag a joint to its place; the right button frees it. The wheel zooms, the middle button moves the picture, a double click shows all of it, F frames the hand. Without a mouse: comma and point choose a joint, arrows move it, Delete frees it.</source>
        <translation>Ein Gelenk an seinen Ort ziehen; die rechte Taste gibt es frei. Das Rad zoomt, die mittlere Taste verschiebt das Bild, ein Doppelklick zeigt alles, F holt die Hand ins Bild. Ohne Maus: Komma und Punkt wählen ein Gelenk, Pfeile bewegen es, Entf gibt es frei.</translation>
    </message>
    <message>
        <source>no picture of this camera</source>
        <translation>kein Bild dieser Kamera</translation>
    </message>
    <message>
        <source>, {error:.1f} px away</source>
        <translation>, {error:.1f} px entfernt</translation>
    </message>
    <message>
        <source>Camera {name}: what it saw a moment ago, and the markers found in that picture.
A full ring is a marker seen whole, a broken ring one that is half hidden or doubtful.
Names stand in large pictures, and in small ones while the mouse is over them.
Of a bare hand: green its outline, blue contours within it, red the edges that are its, yellow others; white a pose that the hand is to take before it is followed.</source>
        <translation>Kamera {name}: was sie eben gesehen hat, und die Marker, die in diesem Bild gefunden wurden.
Ein voller Ring ist ein ganz gesehener Marker, ein unterbrochener ein halb verdeckter oder zweifelhafter.
Namen stehen in großen Bildern, und in kleinen, solange die Maus darüber ist.
Von einer bloßen Hand: grün ihr Umriss, blau Konturen darin, rot die Kanten, die zu ihr gehören, gelb andere; weiß eine Pose, die die Hand einnehmen soll, bevor sie verfolgt wird.</translation>
    </message>
    <message>
        <source>no picture yet</source>
        <translation>noch kein Bild</translation>
    </message>
    <message>
        <source>each hand</source>
        <comment>Take this pose with each hand</comment>
        <translation>jeder Hand</translation>
    </message>
    <message>
        <source>the left hand</source>
        <comment>Take this pose with the left hand</comment>
        <translation>der linken Hand</translation>
    </message>
    <message>
        <source>the right hand</source>
        <comment>Take this pose with the right hand</comment>
        <translation>der rechten Hand</translation>
    </message>
    <message>
        <source>Pictures appear here once a rig is open and its nodes answer.</source>
        <translation>Hier erscheinen Bilder, sobald ein Rig geöffnet ist und seine Knoten antworten.</translation>
    </message>
    <message>
        <source>spread</source>
        <translation>spreizen</translation>
    </message>
    <message>
        <source>turn</source>
        <translation>drehen</translation>
    </message>
    <message>
        <source>palm</source>
        <translation>Handfläche</translation>
    </message>
    <message>
        <source>; size {size}</source>
        <translation>; Größe {size}</translation>
    </message>
    <message>
        <source>Show the {hand}&apos;s angles. It is {word}.</source>
        <translation>Die Winkel zeigen: {hand}. Zustand: {word}.</translation>
    </message>
    <message>
        <source>not tracking</source>
        <translation>keine Verfolgung</translation>
    </message>
    <message>
        <source>The nodes do not stream. Press Start.</source>
        <translation>Die Knoten senden nicht. Start drücken.</translation>
    </message>
    <message>
        <source>not seen</source>
        <translation>nicht gesehen</translation>
    </message>
    <message>
        <source>Nothing has been seen of it for a second.</source>
        <translation>Seit einer Sekunde war nichts davon zu sehen.</translation>
    </message>
    <message>
        <source>No rig is open.</source>
        <translation>Kein Rig ist geöffnet.</translation>
    </message>
    <message>
        <source>Node {name}: {word}, {rate}, {losses}, {clock}</source>
        <translation>Knoten {name}: {word}, {rate}, {losses}, {clock}</translation>
    </message>
    <message>
        <source>No word from the engine about its nodes.</source>
        <translation>Die Engine sagt nichts über ihre Knoten.</translation>
    </message>
    <message>
        <source>AMBIGUOUS</source>
        <translation>MEHRDEUTIG</translation>
    </message>
    <message>
        <source>PREDICTED</source>
        <translation>VORHERGESAGT</translation>
    </message>
    <message>
        <source>No camera has seen it yet. Are its tags in sight, sharp and at least 20 px large?</source>
        <translation>Noch keine Kamera hat es gesehen. Sind seine Tags im Blick, scharf und mindestens 20 px groß?</translation>
    </message>
    <message>
        <source>Seen within the last tenth of a second.</source>
        <translation>In der letzten Zehntelsekunde gesehen.</translation>
    </message>
    <message>
        <source>Two poses explain its tags. Show a second tag, or the tag to a second camera.</source>
        <translation>Zwei Posen erklären seine Tags. Einen zweiten Tag zeigen oder den Tag einer zweiten Kamera.</translation>
    </message>
    <message>
        <source>Not seen for a tenth of a second; it is where it would be if it went on moving.</source>
        <translation>Seit einer Zehntelsekunde nicht gesehen; es ist dort, wo es wäre, wenn es sich weiterbewegte.</translation>
    </message>
    <message>
        <source>Not seen for half a second.</source>
        <translation>Seit einer halben Sekunde nicht gesehen.</translation>
    </message>
    <message>
        <source>{name}: no state yet</source>
        <translation>{name}: noch kein Zustand</translation>
    </message>
    <message>
        <source>{finger} touches</source>
        <translation>{finger} berührt</translation>
    </message>
    <message>
        <source>State: {word} {rate}</source>
        <translation>Zustand: {word} {rate}</translation>
    </message>
    <message>
        <source>Jitter per marker</source>
        <translation>Jitter je Marker</translation>
    </message>
    <message>
        <source>mm rms</source>
        <translation>mm rms</translation>
    </message>
    <message>
        <source>Latency by stage</source>
        <translation>Latenz nach Stufen</translation>
    </message>
    <message>
        <source>budget</source>
        <translation>Budget</translation>
    </message>
    <message>
        <source>all</source>
        <translation>alles</translation>
    </message>
    <message>
        <source>p50 of all</source>
        <translation>p50 von allem</translation>
    </message>
    <message>
        <source>p99 of all</source>
        <translation>p99 von allem</translation>
    </message>
    <message>
        <source>Rate and losses</source>
        <translation>Rate und Verluste</translation>
    </message>
    <message>
        <source>per second</source>
        <translation>pro Sekunde</translation>
    </message>
    <message>
        <source>states</source>
        <translation>Zustände</translation>
    </message>
    <message>
        <source>lost /s</source>
        <translation>Verluste /s</translation>
    </message>
    <message>
        <source>{name}: {value:.3g} {unit}, above the axis</source>
        <translation>{name}: {value:.3g} {unit}, über der Achse</translation>
    </message>
    <message>
        <source>{more} more: scroll</source>
        <translation>{more} weitere: scrollen</translation>
    </message>
    <message>
        <source>More buttons</source>
        <translation>Weitere Knöpfe</translation>
    </message>
    <message>
        <source>No hand is tracked, so there are no layers. Press Start, and show the hand to the cameras.</source>
        <translation>Keine Hand wird verfolgt, daher gibt es keine Ebenen. Start drücken und die Hand den Kameras zeigen.</translation>
    </message>
    <message>
        <source>The first picture takes a moment, the very first one of all half a minute.</source>
        <translation>Das erste Bild dauert einen Moment, das allererste eine halbe Minute.</translation>
    </message>
    <message>
        <source>1 is the link that nothing hides. A line is white beside the background, and black before another link. A number in brackets: the links hide each other in a circle, which is cut there.</source>
        <translation>1 ist das Glied, das nichts verdeckt. Eine Linie ist weiß neben dem Hintergrund und schwarz vor einem anderen Glied. Eine Zahl in Klammern: Die Glieder verdecken einander im Kreis, der dort aufgetrennt ist.</translation>
    </message>
    <message>
        <source>Layers of the hand</source>
        <translation>Ebenen der Hand</translation>
    </message>
    <message>
        <source>Whose picture is shown. Each camera has an order of its own.</source>
        <translation>Wessen Bild gezeigt wird. Jede Kamera hat eine eigene Reihenfolge.</translation>
    </message>
    <message>
        <source>Camera</source>
        <translation>Kamera</translation>
    </message>
    <message>
        <source>Over the picture</source>
        <translation>Über dem Bild</translation>
    </message>
    <message>
        <source>Off: the layers on plain grey, as fast as states come.</source>
        <translation>Aus: die Ebenen auf schlichtem Grau, so schnell Zustände kommen.</translation>
    </message>
    <message>
        <source>Pause</source>
        <translation>Pause</translation>
    </message>
    <message>
        <source>Hold what is shown (Space).</source>
        <translation>Festhalten, was gezeigt wird (Leertaste).</translation>
    </message>
    <message>
        <source>Visibility order</source>
        <translation>Sichtbarkeitsreihenfolge</translation>
    </message>
    <message>
        <source>Layers over the camera&apos;s picture</source>
        <translation>Ebenen über dem Bild der Kamera</translation>
    </message>
    <message>
        <source>Stop the plot to look at it; the measurement goes on.</source>
        <translation>Das Diagramm anhalten, um es anzusehen; die Messung läuft weiter.</translation>
    </message>
    <message>
        <source>the pose alone</source>
        <translation>nur die Pose</translation>
    </message>
    <message>
        <source>pose and lengths</source>
        <translation>Pose und Längen</translation>
    </message>
    <message>
        <source>pose, lengths and finger roots</source>
        <translation>Pose, Längen und Fingerwurzeln</translation>
    </message>
    <message>
        <source>Take pictures</source>
        <translation>Bilder aufnehmen</translation>
    </message>
    <message>
        <source>The pictures of all cameras now, as one more instant (Space). Hold the hand still.</source>
        <translation>Die Bilder aller Kameras jetzt, als weiterer Augenblick (Leertaste). Die Hand still halten.</translation>
    </message>
    <message>
        <source>Open pictures …</source>
        <translation>Bilder öffnen …</translation>
    </message>
    <message>
        <source>Picture or video files of one instant, one for each camera. They are told apart by the cameras&apos; names in theirs, or sorted (Ctrl+O).</source>
        <translation>Bild- oder Videodateien eines Augenblicks, eine je Kamera. Sie werden am Namen der Kamera in ihrem Namen unterschieden oder sortiert (Strg+O).</translation>
    </message>
    <message>
        <source>Find the hand</source>
        <translation>Hand suchen</translation>
    </message>
    <message>
        <source>Look for the hand by the landmark networks (rhot landmarks install), and put all its joints there.</source>
        <translation>Die Hand mit den Landmarken-Netzen suchen (rhot landmarks install) und alle Gelenke dorthin setzen.</translation>
    </message>
    <message>
        <source>Which pictures are shown. All instants share the lengths; each has its own pose.</source>
        <translation>Welche Bilder gezeigt werden. Alle Augenblicke teilen sich die Längen; jeder hat seine eigene Pose.</translation>
    </message>
    <message>
        <source>Instant</source>
        <translation>Augenblick</translation>
    </message>
    <message>
        <source>Remove the instant shown; undo brings it back.</source>
        <translation>Den gezeigten Augenblick entfernen; Rückgängig holt ihn zurück.</translation>
    </message>
    <message>
        <source>Redo</source>
        <translation>Wiederholen</translation>
    </message>
    <message>
        <source>What a drag or a fit may change</source>
        <translation>Was Ziehen oder Anpassen ändern darf</translation>
    </message>
    <message>
        <source>What a drag or a fit may change. Begin with the pose; free lengths when the anchors or contours of two cameras or two instants show them.</source>
        <translation>Was Ziehen oder Anpassen ändern darf. Mit der Pose beginnen; Längen freigeben, wenn Anker oder Konturen zweier Kameras oder zweier Augenblicke sie zeigen.</translation>
    </message>
    <message>
        <source>Standard deviation of an anchor</source>
        <translation>Standardabweichung eines Ankers</translation>
    </message>
    <message>
        <source>How exactly you can point at a joint in these pictures. The standard deviations and Fit to anchors go by it; a drag meets the pointer whatever it is.</source>
        <translation>Wie genau sich ein Gelenk in diesen Bildern zeigen lässt. Die Standardabweichungen und „An Anker anpassen“ richten sich danach; beim Ziehen folgt das Gelenk dem Zeiger in jedem Fall.</translation>
    </message>
    <message>
        <source>Fit to anchors</source>
        <translation>An Anker anpassen</translation>
    </message>
    <message>
        <source>The most probable hand by all anchors at once (Ctrl+Return).</source>
        <translation>Die wahrscheinlichste Hand nach allen Ankern zugleich (Strg+Eingabe).</translation>
    </message>
    <message>
        <source>Fit to contours</source>
        <translation>An Konturen anpassen</translation>
    </message>
    <message>
        <source>Search the edges of the hand in the pictures, from where it is now, and fit it to them (Ctrl+Shift+Return).</source>
        <translation>Die Kanten der Hand in den Bildern suchen, ausgehend von ihrem jetzigen Ort, und sie daran anpassen (Strg+Umschalt+Eingabe).</translation>
    </message>
    <message>
        <source>Free all joints</source>
        <translation>Alle Gelenke freigeben</translation>
    </message>
    <message>
        <source>Remove all anchors of this instant.</source>
        <translation>Alle Anker dieses Augenblicks entfernen.</translation>
    </message>
    <message>
        <source>Reset</source>
        <translation>Neu</translation>
    </message>
    <message>
        <source>Back to the hand and the poses of the beginning; undo brings everything back.</source>
        <translation>Zurück zur Hand und den Posen vom Anfang; Rückgängig holt alles zurück.</translation>
    </message>
    <message>
        <source>Save hand file …</source>
        <translation>Handdatei speichern …</translation>
    </message>
    <message>
        <source>Write the hand as a hand file (Ctrl+S).</source>
        <translation>Die Hand als Handdatei schreiben (Strg+S).</translation>
    </message>
    <message>
        <source>Use this hand</source>
        <translation>Diese Hand benutzen</translation>
    </message>
    <message>
        <source>Put the hand into the rig. The rig file keeps what it had; Calibrate, Bring back an earlier calibration restores it.</source>
        <translation>Die Hand ins Rig übernehmen. Die Rig-Datei behält, was sie hatte; Kalibrieren, Frühere Kalibrierung zurückholen stellt es wieder her.</translation>
    </message>
    <message>
        <source>Escape.</source>
        <translation>Escape.</translation>
    </message>
    <message>
        <source>Give the search up.</source>
        <translation>Die Suche aufgeben.</translation>
    </message>
    <message>
        <source>Save hand file</source>
        <translation>Handdatei speichern</translation>
    </message>
    <message>
        <source>Write the hand to {out} (Ctrl+S).</source>
        <translation>Die Hand in {out} schreiben (Strg+S).</translation>
    </message>
    <message>
        <source>Anchors ±</source>
        <translation>Anker ±</translation>
    </message>
    <message>
        <source>Takes back: {change}.</source>
        <translation>Nimmt zurück: {change}.</translation>
    </message>
    <message>
        <source>Nothing to undo.</source>
        <translation>Nichts rückgängig zu machen.</translation>
    </message>
    <message>
        <source>Brings back: {change}.</source>
        <translation>Holt zurück: {change}.</translation>
    </message>
    <message>
        <source>Nothing to redo.</source>
        <translation>Nichts zu wiederholen.</translation>
    </message>
    <message>
        <source>Begin the plot anew and fit the axes.</source>
        <translation>Das Diagramm neu beginnen und die Achsen anpassen.</translation>
    </message>
    <message>
        <source>Copy CSV</source>
        <translation>CSV</translation>
    </message>
    <message>
        <source>Copy what the plot shows to the clipboard as comma-separated text.</source>
        <translation>Was das Diagramm zeigt, als kommagetrennten Text in die Zwischenablage kopieren.</translation>
    </message>
    <message>
        <source>time before now [s]</source>
        <translation>Zeit vor jetzt [s]</translation>
    </message>
    <message numerus="yes">
        <source>Copied “{title}” to the clipboard: {n} row of comma-separated text.</source>
        <comment>Copied “{title}” to the clipboard: {n} rows of comma-separated text.</comment>
        <translation>
            <numerusform>„{title}“ in die Zwischenablage kopiert: {n} Zeile kommagetrennter Text.</numerusform>
            <numerusform>„{title}“ in die Zwischenablage kopiert: {n} Zeilen kommagetrennter Text.</numerusform>
        </translation>
    </message>
    <message>
        <source>“{title}” shows nothing yet, so only the headings were copied.</source>
        <translation>„{title}“ zeigt noch nichts, daher wurden nur die Überschriften kopiert.</translation>
    </message>
    <message>
        <source>up [mm]</source>
        <translation>oben [mm]</translation>
    </message>
    <message>
        <source>its uncertainty is not estimated</source>
        <translation>seine Unsicherheit ist nicht geschätzt</translation>
    </message>
    <message>
        <source>{spread} along the worst axis (one sigma)</source>
        <translation>{spread} entlang der schlechtesten Achse (ein Sigma)</translation>
    </message>
    <message>
        <source>marker {name}</source>
        <translation>Marker {name}</translation>
    </message>
    <message>
        <source>{finger} joint</source>
        <translation>Gelenk: {finger}</translation>
    </message>
    <message>
        <source>{finger} {name} joint</source>
        <translation>{name}-Gelenk: {finger}</translation>
    </message>
    <message>
        <source>true size</source>
        <translation>wahre Größe</translation>
    </message>
    <message>
        <source>drawn {factor} × larger</source>
        <translation>{factor} × größer gezeichnet</translation>
    </message>
    <message>
        <source>{sigma:.0f} sigma of the pictures alone</source>
        <translation>{sigma:.0f} sigma der Bilder allein</translation>
    </message>
    <message>
        <source>, cut at {most:.0f} mm</source>
        <translation>, bei {most:.0f} mm abgeschnitten</translation>
    </message>
    <message>
        <source>tracker: {tracker}</source>
        <translation>Tracker: {tracker}</translation>
    </message>
    <message>
        <source>Scene</source>
        <translation>Szene</translation>
    </message>
    <message>
        <source>Three-dimensional scene of the hand and the cameras</source>
        <translation>Dreidimensionale Szene mit der Hand und den Kameras</translation>
    </message>
    <message>
        <source>Start tracking</source>
        <translation>Verfolgung starten</translation>
    </message>
    <message>
        <source>Tell the nodes to stream (Space).</source>
        <translation>Die Knoten senden lassen (Leertaste).</translation>
    </message>
    <message>
        <source>Show or hide the panel.</source>
        <translation>Das Feld ein- oder ausblenden.</translation>
    </message>
    <message>
        <source>Holds still</source>
        <translation>Hält still</translation>
    </message>
    <message>
        <source>Waves</source>
        <translation>Winkt</translation>
    </message>
    <message>
        <source>Waves briskly</source>
        <translation>Winkt flott</translation>
    </message>
    <message>
        <source>Moves every joint</source>
        <translation>Bewegt jedes Gelenk</translation>
    </message>
    <message>
        <source>Moves and turns</source>
        <translation>Bewegt und dreht sich</translation>
    </message>
    <message>
        <source>Holds a tagged cube</source>
        <translation>Hält einen Würfel mit Tags</translation>
    </message>
    <message>
        <source>The hand waves with a cube of 40 mm that has a tag on each face. Rig, Add a tracked object offers its file.</source>
        <translation>Die Hand winkt mit einem Würfel von 40 mm, der auf jeder Seite einen Tag hat. Rig, Verfolgtes Objekt hinzufügen bietet seine Datei an.</translation>
    </message>
    <message>
        <source>Takes its markers off</source>
        <translation>Legt ihre Marker ab</translation>
    </message>
    <message>
        <source>A bare hand that opens and closes.</source>
        <translation>Eine bloße Hand, die sich öffnet und schließt.</translation>
    </message>
    <message>
        <source>Holds a bare hand still</source>
        <translation>Hält eine bloße Hand still</translation>
    </message>
    <message>
        <source>A bare hand that does not move. Calibrate, Tracker chooses what follows it.</source>
        <translation>Eine bloße Hand, die sich nicht bewegt. Kalibrieren, Tracker wählt aus, was sie verfolgt.</translation>
    </message>
    <message>
        <source>Leaves the pictures</source>
        <translation>Verlässt die Bilder</translation>
    </message>
    <message>
        <source>The background alone: Calibrate, Background and skin begins with it.</source>
        <translation>Nur der Hintergrund: Damit beginnt Kalibrieren, Hintergrund und Haut.</translation>
    </message>
    <message>
        <source>Shows a board</source>
        <translation>Zeigt ein Brett</translation>
    </message>
    <message>
        <source>A chessboard of 9 x 6 corners, 25 mm squares, moved about with pauses.</source>
        <translation>Ein Schachbrett mit 9 x 6 Ecken, Felder von 25 mm, mit Pausen umherbewegt.</translation>
    </message>
    <message>
        <source>Lays the board on the table</source>
        <translation>Legt das Brett auf den Tisch</translation>
    </message>
    <message>
        <source>The same board, lying on the table.</source>
        <translation>Dasselbe Brett, auf dem Tisch liegend.</translation>
    </message>
    <message>
        <source>Shows a ruler</source>
        <translation>Zeigt ein Lineal</translation>
    </message>
    <message>
        <source>A paper ruler with two crosses, 200 mm apart.</source>
        <translation>Ein Papierlineal mit zwei Kreuzen im Abstand von 200 mm.</translation>
    </message>
    <message>
        <source>Scenes (*.json);;All files (*)</source>
        <translation>Szenen (*.json);;Alle Dateien (*)</translation>
    </message>
    <message>
        <source>One painted ball, {distance} cm from the cameras, before the middle between them.</source>
        <translation>Eine bemalte Kugel, {distance} cm von den Kameras entfernt, mittig vor ihnen.</translation>
    </message>
    <message>
        <source>Shows one marker at</source>
        <translation>Zeigt einen Marker bei</translation>
    </message>
    <message>
        <source>Another motion</source>
        <translation>Andere Bewegung</translation>
    </message>
    <message>
        <source>A cap on the lens of the camera {name}: it sees nothing until it is taken off.</source>
        <translation>Eine Kappe auf dem Objektiv der Kamera {name}: Sie sieht nichts, bis sie abgenommen wird.</translation>
    </message>
    <message>
        <source>Open a scene</source>
        <translation>Szene öffnen</translation>
    </message>
    <message>
        <source>Save the scene</source>
        <translation>Szene speichern</translation>
    </message>
    <message>
        <source>The scene was saved to {path}.</source>
        <translation>Die Szene wurde in {path} gespeichert.</translation>
    </message>
    <message>
        <source>The simulated cameras have stopped.</source>
        <translation>Die simulierten Kameras sind stehen geblieben.</translation>
    </message>
    <message>
        <source>Start them again</source>
        <translation>Neu starten</translation>
    </message>
    <message>
        <source>This engine was started outside the app; closing the app lets it run on.</source>
        <translation>Diese Engine wurde außerhalb der App gestartet; sie läuft weiter, wenn die App schließt.</translation>
    </message>
    <message>
        <source>Recording to {path} ({size}).</source>
        <translation>Aufnahme in {path} ({size}).</translation>
    </message>
    <message>
        <source>REC {size}</source>
        <translation>REC {size}</translation>
    </message>
    <message>
        <source>Recording to {path}. A click here, or B, sets a bookmark.</source>
        <translation>Aufnahme in {path}. Ein Klick hier oder B setzt ein Lesezeichen.</translation>
    </message>
    <message>
        <source>REPLAY {name}</source>
        <translation>WIEDERGABE {name}</translation>
    </message>
    <message>
        <source>An engine replays {path}; Start replays it again.</source>
        <translation>Eine Engine spielt {path} ab; Start spielt es noch einmal ab.</translation>
    </message>
    <message>
        <source>Calibrate …</source>
        <translation>Kalibrieren …</translation>
    </message>
    <message>
        <source>This computer renders the simulated cameras at {achieved:.0f} of {preset:.0f} Hz; the tracking is real all the same.</source>
        <translation>Dieser Rechner rendert die simulierten Kameras mit {achieved:.0f} von {preset:.0f} Hz; die Verfolgung ist trotzdem echt.</translation>
    </message>
    <message>
        <source>The engine stopped. The app is starting it again; the nodes re-join by themselves.</source>
        <translation>Die Engine ist stehen geblieben. Die App startet sie neu; die Knoten melden sich von selbst wieder an.</translation>
    </message>
    <message>
        <source>The engine stopped and could not be started again.{reason}</source>
        <translation>Die Engine ist stehen geblieben und ließ sich nicht neu starten.{reason}</translation>
    </message>
    <message>
        <source>Try again</source>
        <translation>Noch einmal</translation>
    </message>
    <message>
        <source>One moment. Cancel ends what was started.</source>
        <translation>Einen Moment. Abbrechen beendet, was gestartet wurde.</translation>
    </message>
    <message>
        <source>Choose how to begin. F1 opens the guide.</source>
        <translation>Auswählen, womit es losgehen soll. F1 öffnet die Anleitung.</translation>
    </message>
    <message>
        <source>Press Start, or the space bar, to begin tracking.</source>
        <translation>Start oder die Leertaste drücken, um mit der Verfolgung zu beginnen.</translation>
    </message>
    <message>
        <source>Everything is in order.</source>
        <translation>Alles ist in Ordnung.</translation>
    </message>
    <message>
        <source>The rig was saved to {path}. What stood there before is kept in {name}.history.</source>
        <translation>Das Rig wurde in {path} gespeichert. Was dort stand, bleibt in {name}.history erhalten.</translation>
    </message>
    <message>
        <source>Add a tracked object</source>
        <translation>Verfolgtes Objekt hinzufügen</translation>
    </message>
    <message>
        <source>Object files (*.json);;All files (*)</source>
        <translation>Objektdateien (*.json);;Alle Dateien (*)</translation>
    </message>
    <message>
        <source>Take {name} out of the rig; its file stays.</source>
        <translation>{name} aus dem Rig nehmen; die Datei bleibt.</translation>
    </message>
    <message>
        <source>{name} is tracked from now on, and stands in the rig.</source>
        <translation>{name} wird von jetzt an verfolgt und steht im Rig.</translation>
    </message>
    <message>
        <source>{name} is not tracked any more.</source>
        <translation>{name} wird nicht mehr verfolgt.</translation>
    </message>
    <message>
        <source>{words} Calibrate, Bring back an earlier calibration undoes it.</source>
        <translation>{words} Kalibrieren, Frühere Kalibrierung zurückholen macht es rückgängig.</translation>
    </message>
    <message>
        <source>How do you want to begin?</source>
        <translation>Womit soll es losgehen?</translation>
    </message>
    <message>
        <source>RHOT tracks a hand with cheap cameras: a bare hand with one, a hand that wears six colour markers with two. No camera at hand? The simulated rig shows everything.</source>
        <translation>RHOT verfolgt eine Hand mit günstigen Kameras: eine bloße Hand mit einer, eine Hand mit sechs Farbmarkern mit zwei. Keine Kamera zur Hand? Das simulierte Rig zeigt alles.</translation>
    </message>
    <message>
        <source>What the simulated hand does.</source>
        <translation>Was die simulierte Hand tut.</translation>
    </message>
    <message>
        <source>Motion of the simulated hand</source>
        <translation>Bewegung der simulierten Hand</translation>
    </message>
    <message>
        <source>Start the simulated rig</source>
        <translation>Simuliertes Rig starten</translation>
    </message>
    <message>
        <source>Open a rig file …</source>
        <translation>Rig-Datei öffnen …</translation>
    </message>
    <message>
        <source>Choose cameras …</source>
        <translation>Kameras auswählen …</translation>
    </message>
    <message>
        <source>Two simulated cameras look at a simulated hand, through real node programs and the real network path.</source>
        <translation>Zwei simulierte Kameras sehen eine simulierte Hand, über echte Knotenprogramme und den echten Weg durchs Netz.</translation>
    </message>
    <message>
        <source>Cameras of this computer</source>
        <translation>Kameras dieses Rechners</translation>
    </message>
    <message>
        <source>A webcam or two, films, or a network camera such as a phone. One is enough to begin with a bare hand.</source>
        <translation>Eine Webcam oder zwei, Filme oder eine Netzwerkkamera wie ein Telefon. Für den Anfang genügt eine, mit bloßer Hand.</translation>
    </message>
    <message>
        <source>Two nodes</source>
        <translation>Zwei Knoten</translation>
    </message>
    <message>
        <source>Enter the addresses of two Raspberry Pis that run rhot-node, see whether they answer, and write a first rig file.</source>
        <translation>Die Adressen zweier Raspberry Pis eingeben, auf denen rhot-node läuft, prüfen, ob sie antworten, und eine erste Rig-Datei schreiben.</translation>
    </message>
    <message>
        <source>Rig file</source>
        <translation>Rig-Datei</translation>
    </message>
    <message>
        <source>A rig that was set up before: its cameras, lenses, marker set and hand.</source>
        <translation>Ein Rig, das schon eingerichtet ist: Kameras, Objektive, Markersatz und Hand.</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Abbrechen</translation>
    </message>
    <message>
        <source>Open {name}</source>
        <translation>{name} öffnen</translation>
    </message>
    <message>
        <source>The rig opened last: {name}</source>
        <translation>Das zuletzt geöffnete Rig: {name}</translation>
    </message>
    <message>
        <source>camera {camera} gave a picture that cannot be read; restart its node.</source>
        <translation>Kamera {camera} lieferte ein Bild, das nicht lesbar ist; ihren Knoten neu starten.</translation>
    </message>
    <message>
        <source>{name} (id {node_id}) answers; it is {state}.</source>
        <translation>{name} (ID {node_id}) antwortet; Zustand: {state}.</translation>
    </message>
    <message>
        <source>{begin} Paired with this computer.</source>
        <translation>{begin} Mit diesem Rechner gekoppelt.</translation>
    </message>
    <message>
        <source>{begin} Open: anybody on the network may see its pictures and steer it.</source>
        <translation>{begin} Offen: Jeder im Netz kann seine Bilder sehen und ihn steuern.</translation>
    </message>
    <message>
        <source>{begin} Not paired with this computer: press Pair.</source>
        <translation>{begin} Nicht mit diesem Rechner gekoppelt: Koppeln drücken.</translation>
    </message>
    <message>
        <source>A rig needs two nodes that answer and are paired with this computer.</source>
        <translation>Ein Rig braucht zwei Knoten, die antworten und mit diesem Rechner gekoppelt sind.</translation>
    </message>
    <message>
        <source>Both nodes have the id {node_id}; give one another node_id in its settings file.</source>
        <translation>Beide Knoten haben die ID {node_id}; einem davon in seiner Einstellungsdatei eine andere node_id geben.</translation>
    </message>
    <message>
        <source>The process that computes ended unexpectedly; try again. If it happens again, it may have run out of memory: use fewer pictures or a shorter recording.</source>
        <translation>Der rechnende Prozess endete unerwartet; noch einmal versuchen. Geschieht es wieder, reichte vielleicht der Speicher nicht: weniger Bilder oder eine kürzere Aufnahme nehmen.</translation>
    </message>
    <message>
        <source>No node was found. Is rhot-node running there, and on the same network? Some networks let no search through: then type the address in below.</source>
        <translation>Kein Knoten wurde gefunden. Läuft rhot-node dort, und im selben Netz? Manche Netze lassen keine Suche durch: dann die Adresse unten eintippen.</translation>
    </message>
    <message>
        <source>open to everybody</source>
        <translation>offen für alle</translation>
    </message>
    <message>
        <source>not paired yet</source>
        <translation>noch nicht gekoppelt</translation>
    </message>
    <message>
        <source>paired</source>
        <translation>gekoppelt</translation>
    </message>
    <message>
        <source>id</source>
        <translation>ID</translation>
    </message>
    <message>
        <source>address</source>
        <translation>Adresse</translation>
    </message>
    <message>
        <source>trust</source>
        <translation>Vertrauen</translation>
    </message>
    <message>
        <source>state</source>
        <translation>Zustand</translation>
    </message>
    <message>
        <source>announces itself</source>
        <translation>meldet sich</translation>
    </message>
    <message>
        <source>Nodes on the network</source>
        <translation>Knoten im Netz</translation>
    </message>
    <message>
        <source>Looking for nodes …</source>
        <translation>Knoten werden gesucht …</translation>
    </message>
    <message>
        <source>Use as {side} camera</source>
        <translation>Als Kamera {side} nehmen</translation>
    </message>
    <message>
        <source>Possible once a node is selected in the list.</source>
        <translation>Möglich, sobald ein Knoten in der Liste ausgewählt ist.</translation>
    </message>
    <message>
        <source>Two networks find 21 landmarks of a bare hand in a picture. They are MediaPipe&apos;s, under the {licence}, which is placed beside them. Install downloads the package {package} (36 MB), takes them out of it and checks them. Nothing else of it is kept. Nodes on other computers install theirs by `rhot-node landmarks install`.</source>
        <translation>Zwei Netze finden 21 Landmarken einer bloßen Hand in einem Bild. Sie stammen von MediaPipe, unter der {licence}, die daneben abgelegt wird. Installieren lädt das Paket {package} herunter (36 MB), nimmt sie heraus und prüft sie. Sonst wird nichts davon behalten. Knoten auf anderen Rechnern installieren ihre mit `rhot-node landmarks install`.</translation>
    </message>
    <message>
        <source>Hand networks</source>
        <translation>Hand-Netze</translation>
    </message>
    <message>
        <source>Install</source>
        <translation>Installieren</translation>
    </message>
    <message>
        <source>From a file …</source>
        <translation>Aus einer Datei …</translation>
    </message>
    <message>
        <source>Download and place them. What is there is replaced when all is complete.</source>
        <translation>Herunterladen und ablegen. Vorhandenes wird ersetzt, wenn alles vollständig ist.</translation>
    </message>
    <message>
        <source>Take them out of the wheel of {package} that you have, without network.</source>
        <translation>Sie ohne Netz aus dem vorhandenen Wheel von {package} nehmen.</translation>
    </message>
    <message>
        <source>End the installation; what was there stays.</source>
        <translation>Die Installation beenden; was da war, bleibt.</translation>
    </message>
    <message>
        <source>Cancelled. What was there before is there still.</source>
        <translation>Abgebrochen. Was vorher da war, ist noch da.</translation>
    </message>
    <message>
        <source>The wheel of {package}</source>
        <translation>Das Wheel von {package}</translation>
    </message>
    <message>
        <source>Wheels (*.whl);;All files (*)</source>
        <translation>Wheels (*.whl);;Alle Dateien (*)</translation>
    </message>
    <message>
        <source>They are not installed on this computer.</source>
        <translation>Sie sind auf diesem Rechner nicht installiert.</translation>
    </message>
    <message>
        <source>They are installed and whole, in {folder}.</source>
        <translation>Sie sind vollständig installiert, in {folder}.</translation>
    </message>
    <message>
        <source>Paint or tape in six colours</source>
        <translation>Farbe oder Klebeband in sechs Farben</translation>
    </message>
    <message>
        <source>A bare hand</source>
        <translation>Eine bloße Hand</translation>
    </message>
    <message>
        <source>Landmarks or nodes of my own</source>
        <translation>Eigene Landmarken oder Knoten</translation>
    </message>
    <message>
        <source>one camera</source>
        <translation>eine Kamera</translation>
    </message>
    <message>
        <source>two cameras</source>
        <translation>zwei Kameras</translation>
    </message>
    <message>
        <source>Do not open by itself</source>
        <translation>Nicht von selbst öffnen</translation>
    </message>
    <message>
        <source>Do not show these steps by themselves. Calibrate, What to do next shows them.</source>
        <translation>Diese Schritte nicht von selbst zeigen. Kalibrieren, Was als Nächstes zu tun ist zeigt sie.</translation>
    </message>
    <message>
        <source>done</source>
        <translation>erledigt</translation>
    </message>
    <message>
        <source>not done yet</source>
        <translation>noch nicht erledigt</translation>
    </message>
    <message>
        <source>All is done: hold the hand before the cameras.</source>
        <translation>Alles ist erledigt: die Hand vor die Kameras halten.</translation>
    </message>
    <message>
        <source>Write the board</source>
        <translation>Das Brett schreiben</translation>
    </message>
    <message>
        <source>PDF (*.pdf)</source>
        <translation>PDF (*.pdf)</translation>
    </message>
    <message>
        <source>Written: {path}. Print it at 100 % and measure the ruler on it.</source>
        <translation>Geschrieben: {path}. Mit 100 % drucken und das Lineal darauf nachmessen.</translation>
    </message>
    <message>
        <source>{path}: cannot be written ({strerror}).</source>
        <translation>{path}: lässt sich nicht schreiben ({strerror}).</translation>
    </message>
    <message>
        <source>{title} is on</source>
        <translation>{title} ist an</translation>
    </message>
    <message>
        <source>On or off, at once; one that is off stays in the rig.</source>
        <translation>Sofort an oder aus; eine ausgeschaltete bleibt im Rig.</translation>
    </message>
    <message>
        <source>Change …</source>
        <translation>Ändern …</translation>
    </message>
    <message>
        <source>Remove</source>
        <translation>Entfernen</translation>
    </message>
    <message>
        <source>Another target, other joints, another rate: in the form below.</source>
        <translation>Anderes Ziel, andere Gelenke, andere Rate: im Formular unten.</translation>
    </message>
    <message>
        <source>Close it and take it out of the rig; Undo brings it back.</source>
        <translation>Schließen und aus dem Rig nehmen; Rückgängig holt sie zurück.</translation>
    </message>
    <message>
        <source>Where to connect. The web view&apos;s address has a secret in it: whoever knows it sees the hand.</source>
        <translation>Wohin man sich verbindet. Die Adresse der Webansicht enthält ein Geheimnis: Wer sie kennt, sieht die Hand.</translation>
    </message>
    <message>
        <source>Put the address on the clipboard.</source>
        <translation>Die Adresse in die Zwischenablage kopieren.</translation>
    </message>
    <message>
        <source>The address as a QR code, for a telephone&apos;s or headset&apos;s camera.</source>
        <translation>Die Adresse als QR-Code, für die Kamera eines Telefons oder Headsets.</translation>
    </message>
    <message>
        <source>Estimate the hand&apos;s size</source>
        <translation>Größe der Hand schätzen</translation>
    </message>
    <message>
        <source>Flat, for the 3-D mouse</source>
        <translation>Flach, für die 3-D-Maus</translation>
    </message>
    <message>
        <source>Use this size for the rig&apos;s hand</source>
        <translation>Diese Größe ins Rig übernehmen</translation>
    </message>
    <message>
        <source>Makes every length of the rig&apos;s hand so much larger or smaller. What was there is kept.</source>
        <translation>Macht jede Länge der Hand des Rigs um so viel größer oder kleiner. Was da war, bleibt erhalten.</translation>
    </message>
    <message>
        <source>Fingers bent by</source>
        <translation>Beugung durch</translation>
    </message>
    <message>
        <source>Tracked by</source>
        <translation>Verfolgt über</translation>
    </message>
    <message>
        <source>Fingers</source>
        <translation>Finger</translation>
    </message>
    <message>
        <source>Limits</source>
        <translation>Grenzen</translation>
    </message>
    <message>
        <source>Size</source>
        <translation>Größe</translation>
    </message>
    <message>
        <source>In force.</source>
        <translation>Gilt.</translation>
    </message>
    <message>
        <source>In force until the engine ends: this rig came from no file. Rig, Save rig keeps it.</source>
        <translation>Gilt, bis die Engine endet: Dieses Rig kam aus keiner Datei. Rig, Rig speichern bewahrt es auf.</translation>
    </message>
    <message>
        <source>As in the beginning. Undo brings the fit back.</source>
        <translation>Wie am Anfang. Rückgängig holt die Anpassung zurück.</translation>
    </message>
    <message>
        <source>Undone</source>
        <translation>Rückgängig gemacht</translation>
    </message>
    <message>
        <source>Done again</source>
        <translation>Wiederholt</translation>
    </message>
    <message>
        <source>Fitting to the anchors</source>
        <translation>Anpassung an die Anker</translation>
    </message>
    <message>
        <source>fitting to anchors</source>
        <translation>Anpassung an Anker</translation>
    </message>
    <message>
        <source>Fitted to the anchors of this instant.</source>
        <translation>An die Anker dieses Augenblicks angepasst.</translation>
    </message>
    <message>
        <source>Fitted to the anchors of all instants.</source>
        <translation>An die Anker aller Augenblicke angepasst.</translation>
    </message>
    <message>
        <source>{found:.0%} of the hand&apos;s contour was found in the pictures.</source>
        <translation>{found:.0%} der Kontur der Hand wurde in den Bildern gefunden.</translation>
    </message>
    <message>
        <source> Drag what is wrong to its place, then fit again.</source>
        <translation> Falsches an seinen Ort ziehen und noch einmal anpassen.</translation>
    </message>
    <message>
        <source>Fitting to the contours</source>
        <translation>Anpassung an die Konturen</translation>
    </message>
    <message>
        <source>fitting to contours</source>
        <translation>Anpassung an Konturen</translation>
    </message>
    <message>
        <source>Looking for the hand</source>
        <translation>Die Hand wird gesucht</translation>
    </message>
    <message>
        <source>finding the hand</source>
        <translation>Suche der Hand</translation>
    </message>
    <message>
        <source>Look whether it is the hand; if not, undo and drag the joints instead.</source>
        <translation>Prüfen, ob es die Hand ist; sonst rückgängig machen und die Gelenke ziehen.</translation>
    </message>
    <message>
        <source>Cancelled; nothing was changed.</source>
        <translation>Abgebrochen; nichts wurde geändert.</translation>
    </message>
    <message>
        <source>Save the hand</source>
        <translation>Die Hand speichern</translation>
    </message>
    <message>
        <source>Hand files (*.json)</source>
        <translation>Handdateien (*.json)</translation>
    </message>
    <message>
        <source>{out}: cannot be written ({strerror}); nothing was saved.</source>
        <translation>{out}: lässt sich nicht schreiben ({strerror}); nichts wurde gespeichert.</translation>
    </message>
    <message>
        <source>Saved: {out}</source>
        <translation>Gespeichert: {out}</translation>
    </message>
    <message>
        <source>The rig has this hand already: only the pose was fitted.</source>
        <translation>Das Rig hat diese Hand schon: Nur die Pose wurde angepasst.</translation>
    </message>
    <message>
        <source>The rig has this hand now. Calibrate, Bring back an earlier calibration restores the old one.</source>
        <translation>Das Rig hat jetzt diese Hand. Kalibrieren, Frühere Kalibrierung zurückholen stellt die alte wieder her.</translation>
    </message>
    <message>
        <source>The videos show {length:.2f} s together, and second {at:g} is before that. Choose a later one.</source>
        <translation>Die Videos zeigen gemeinsam {length:.2f} s, und Sekunde {at:g} liegt davor. Eine spätere wählen.</translation>
    </message>
    <message>
        <source>The videos show {length:.2f} s together, and second {at:g} is beyond that. Choose an earlier one.</source>
        <translation>Die Videos zeigen gemeinsam {length:.2f} s, und Sekunde {at:g} liegt dahinter. Eine frühere wählen.</translation>
    </message>
    <message>
        <source>{path}: its frame at second {at_s:g} cannot be read; is the file complete?</source>
        <translation>{path}: Das Bild bei Sekunde {at_s:g} ist nicht lesbar; ist die Datei vollständig?</translation>
    </message>
    <message>
        <source>Fit the hand to pictures</source>
        <translation>Die Hand an Bilder anpassen</translation>
    </message>
    <message>
        <source>Pictures of one instant, one for each camera</source>
        <translation>Bilder eines Augenblicks, eines je Kamera</translation>
    </message>
    <message>
        <source>Pictures and videos ({endings});;All files (*)</source>
        <translation>Bilder und Videos ({endings});;Alle Dateien (*)</translation>
    </message>
    <message>
        <source>Which second of the videos?</source>
        <translation>Welche Sekunde der Videos?</translation>
    </message>
    <message>
        <source>Live pictures</source>
        <translation>Live-Bilder</translation>
    </message>
    <message>
        <source>waiting for the first picture</source>
        <translation>wartet auf das erste Bild</translation>
    </message>
    <message>
        <source>Drag the wrist, the knuckles and the fingertips to their places, or press Find the hand.</source>
        <translation>Handgelenk, Knöchel und Fingerspitzen an ihre Orte ziehen oder Hand suchen drücken.</translation>
    </message>
    <message>
        <source>The hand begins where it is tracked. Drag joints, or fit to the contours.</source>
        <translation>Die Hand beginnt, wo sie verfolgt wird. Gelenke ziehen oder an die Konturen anpassen.</translation>
    </message>
    <message>
        <source>Standard deviation in the unit beside, by the anchors and what is known of people&apos;s hands; after Fit to contours by the contours, too.</source>
        <translation>Standardabweichung in der Einheit daneben, nach den Ankern und dem, was über Menschenhände bekannt ist; nach „An Konturen anpassen“ auch nach den Konturen.</translation>
    </message>
    <message>
        <source>{group}, {name}, slider</source>
        <translation>{group}, {name}, Regler</translation>
    </message>
    <message>
        <source>Which numbers the sliders below move.</source>
        <translation>Welche Zahlen die Regler unten bewegen.</translation>
    </message>
    <message>
        <source>Numbers</source>
        <translation>Zahlen</translation>
    </message>
    <message>
        <source>The hand was changed and not saved. Close without it?</source>
        <translation>Die Hand wurde geändert und nicht gespeichert. Trotzdem schließen?</translation>
    </message>
    <message>
        <source>Palm</source>
        <translation>Handfläche</translation>
    </message>
    <message>
        <source>Hold the hand still in all pictures, fingers spread, and press Take pictures.</source>
        <translation>Die Hand in allen Bildern still halten, Finger gespreizt, und Bilder aufnehmen drücken.</translation>
    </message>
    <message>
        <source>Open a picture of each camera, taken at the same moment.</source>
        <translation>Ein Bild jeder Kamera öffnen, im selben Augenblick aufgenommen.</translation>
    </message>
    <message>
        <source>Drag joints in the pictures or move the numbers until the outline lies on the hand.</source>
        <translation>Gelenke in den Bildern ziehen oder die Zahlen verschieben, bis der Umriss auf der Hand liegt.</translation>
    </message>
    <message>
        <source>no anchors</source>
        <translation>keine Anker</translation>
    </message>
    <message numerus="yes">
        <source>{n} anchor, {rms:.1f} px rms, {most:.1f} px most</source>
        <comment>{n} anchors, {rms:.1f} px rms, {most:.1f} px most</comment>
        <translation>
            <numerusform>{n} Anker, {rms:.1f} px rms, {most:.1f} px höchstens</numerusform>
            <numerusform>{n} Anker, {rms:.1f} px rms, {most:.1f} px höchstens</numerusform>
        </translation>
    </message>
    <message>
        <source>Choose two cameras</source>
        <translation>Zwei Kameras auswählen</translation>
    </message>
    <message>
        <source>Both see the hand; 10 to 50 cm apart.</source>
        <translation>Beide sehen die Hand; 10 bis 50 cm Abstand.</translation>
    </message>
    <message>
        <source>Install the hand networks</source>
        <translation>Die Hand-Netze installieren</translation>
    </message>
    <message>
        <source>They find the joints of a bare hand (36 MB).</source>
        <translation>Sie finden die Gelenke einer bloßen Hand (36 MB).</translation>
    </message>
    <message>
        <source>Print the board</source>
        <translation>Das Brett drucken</translation>
    </message>
    <message>
        <source>A chessboard on A4 at 100 %, glued to something flat.</source>
        <translation>Ein Schachbrett auf A4 bei 100 %, auf etwas Ebenes geklebt.</translation>
    </message>
    <message>
        <source>Calibrate each lens</source>
        <translation>Jedes Objektiv kalibrieren</translation>
    </message>
    <message>
        <source>Until then distances are a guess.</source>
        <translation>Bis dahin sind Abstände geraten.</translation>
    </message>
    <message>
        <source>Missing: {names}.</source>
        <translation>Es fehlt: {names}.</translation>
    </message>
    <message>
        <source>All lenses are known.</source>
        <translation>Alle Objektive sind bekannt.</translation>
    </message>
    <message>
        <source>Put the cameras together</source>
        <translation>Die Kameras zusammensetzen</translation>
    </message>
    <message>
        <source>Where they stand to each other, from the board before both.</source>
        <translation>Wie sie zueinander stehen, vom Brett vor beiden.</translation>
    </message>
    <message>
        <source>Compare the cameras&apos; times</source>
        <translation>Die Zeiten der Kameras vergleichen</translation>
    </message>
    <message>
        <source>Teach the colours</source>
        <translation>Die Farben lernen</translation>
    </message>
    <message>
        <source>Which colour each marker has in this light.</source>
        <translation>Welche Farbe jeder Marker in diesem Licht hat.</translation>
    </message>
    <message>
        <source>Measure your hand</source>
        <translation>Die Hand vermessen</translation>
    </message>
    <message>
        <source>How long its bones are, from a minute of movement.</source>
        <translation>Wie lang ihre Knochen sind, aus einer Minute Bewegung.</translation>
    </message>
    <message>
        <source>Track painted markers</source>
        <translation>Bemalte Marker verfolgen</translation>
    </message>
    <message>
        <source>Six colours: five fingertips and the wrist.</source>
        <translation>Sechs Farben: fünf Fingerspitzen und das Handgelenk.</translation>
    </message>
    <message>
        <source>Track landmarks</source>
        <translation>Landmarken verfolgen</translation>
    </message>
    <message>
        <source>The joints of a bare hand, as networks find them.</source>
        <translation>Die Gelenke einer bloßen Hand, wie Netze sie finden.</translation>
    </message>
    <message>
        <source>No program listens yet. Add OSC for Unity, Blender or TouchDesigner, VMC for avatars, or the web view to see the hand in a browser or a headset.</source>
        <translation>Noch hört kein Programm zu. OSC für Unity, Blender oder TouchDesigner, VMC für Avatare oder die Webansicht hinzufügen, um die Hand in einem Browser oder Headset zu sehen.</translation>
    </message>
    <message>
        <source>own: 21 joints</source>
        <translation>own: 21 Gelenke</translation>
    </message>
    <message>
        <source>Wrist, then four joints of each finger; positions in the rig frame.</source>
        <translation>Handgelenk, dann vier Gelenke jedes Fingers; Positionen im Rig-Koordinatensystem.</translation>
    </message>
    <message>
        <source>openxr: 26 joints</source>
        <translation>openxr: 26 Gelenke</translation>
    </message>
    <message>
        <source>XR_EXT_hand_tracking: positions, orientations and radii in OpenXR&apos;s axes.</source>
        <translation>XR_EXT_hand_tracking: Positionen, Orientierungen und Radien in den Achsen von OpenXR.</translation>
    </message>
    <message>
        <source>mediapipe: 21 joints</source>
        <translation>mediapipe: 21 Gelenke</translation>
    </message>
    <message>
        <source>In the order and by the names of MediaPipe; positions in the rig frame.</source>
        <translation>In der Reihenfolge und mit den Namen von MediaPipe; Positionen im Rig-Koordinatensystem.</translation>
    </message>
    <message>
        <source>What the plug-in understands; see its own documentation.</source>
        <translation>Was das Plug-in versteht; siehe seine eigene Dokumentation.</translation>
    </message>
    <message>
        <source>to</source>
        <translation>an</translation>
    </message>
    <message>
        <source>Messages by UDP, for Unity, Blender, Unreal, TouchDesigner, Max, Pure Data.</source>
        <translation>Nachrichten per UDP, für Unity, Blender, Unreal, TouchDesigner, Max, Pure Data.</translation>
    </message>
    <message>
        <source>HOST:PORT of the program that listens.</source>
        <translation>HOST:PORT des Programms, das zuhört.</translation>
    </message>
    <message>
        <source>Finger bones for avatars: EVMC4U in Unity, VMC4B in Blender, Warudo, VSeeFace.</source>
        <translation>Fingerknochen für Avatare: EVMC4U in Unity, VMC4B in Blender, Warudo, VSeeFace.</translation>
    </message>
    <message>
        <source>HOST:PORT of the program that listens; most take 39539.</source>
        <translation>HOST:PORT des Programms, das zuhört; die meisten nehmen 39539.</translation>
    </message>
    <message>
        <source>Programs connect to this port and get every state as JSON.</source>
        <translation>Programme verbinden sich mit diesem Port und erhalten jeden Zustand als JSON.</translation>
    </message>
    <message>
        <source>[HOST:]PORT to listen on, unencrypted. 127.0.0.1 is this computer only; 0.0.0.0 lets others in.</source>
        <translation>[HOST:]PORT zum Zuhören, unverschlüsselt. 127.0.0.1 ist nur dieser Rechner; 0.0.0.0 lässt andere herein.</translation>
    </message>
    <message>
        <source>on</source>
        <translation>auf</translation>
    </message>
    <message>
        <source>Web view</source>
        <translation>Webansicht</translation>
    </message>
    <message>
        <source>A page that shows the hand in browsers and headsets.</source>
        <translation>Eine Seite, die die Hand in Browsern und Headsets zeigt.</translation>
    </message>
    <message>
        <source>[HOST:]PORT to listen on. 127.0.0.1 is this computer only; 0.0.0.0 lets others in, by HTTPS.</source>
        <translation>[HOST:]PORT zum Zuhören. 127.0.0.1 ist nur dieser Rechner; 0.0.0.0 lässt andere herein, per HTTPS.</translation>
    </message>
    <message>
        <source>LabRecorder and others find the streams by name.</source>
        <translation>LabRecorder und andere finden die Datenströme am Namen.</translation>
    </message>
    <message>
        <source>Name of the streams; RHOT when empty.</source>
        <translation>Name der Datenströme; leer: RHOT.</translation>
    </message>
    <message>
        <source>as</source>
        <translation>als</translation>
    </message>
    <message>
        <source>JSON under the key rhot/state, for robots and ROS 2.</source>
        <translation>JSON unter dem Schlüssel rhot/state, für Roboter und ROS 2.</translation>
    </message>
    <message>
        <source>HOST:PORT of a router; when empty, whoever is found on the network.</source>
        <translation>HOST:PORT eines Routers; leer: wer im Netz gefunden wird.</translation>
    </message>
    <message>
        <source>by</source>
        <translation>über</translation>
    </message>
    <message>
        <source>off</source>
        <translation>aus</translation>
    </message>
    <message>
        <source>Switched off: kept in the rig, and not opened.</source>
        <translation>Ausgeschaltet: bleibt im Rig und wird nicht geöffnet.</translation>
    </message>
    <message>
        <source>opens</source>
        <translation>öffnet</translation>
    </message>
    <message>
        <source>The output is being opened.</source>
        <translation>Die Ausgabe wird geöffnet.</translation>
    </message>
    <message>
        <source>waits</source>
        <translation>wartet</translation>
    </message>
    <message>
        <source>The output is open; nobody listens, or there is nothing to send yet.</source>
        <translation>Die Ausgabe ist offen; niemand hört zu, oder es gibt noch nichts zu senden.</translation>
    </message>
    <message>
        <source>sending</source>
        <translation>sendet</translation>
    </message>
    <message>
        <source>States leave for the other program.</source>
        <translation>Zustände gehen an das andere Programm.</translation>
    </message>
    <message>
        <source>slow</source>
        <translation>langsam</translation>
    </message>
    <message>
        <source>The receiver takes states too slowly; some are dropped. Tracking goes on.</source>
        <translation>Der Empfänger nimmt Zustände zu langsam ab; einige entfallen. Die Verfolgung läuft weiter.</translation>
    </message>
    <message>
        <source>failed</source>
        <translation>gescheitert</translation>
    </message>
    <message>
        <source>The output does not work. It is tried again every 3 s; tracking goes on.</source>
        <translation>Die Ausgabe arbeitet nicht. Alle 3 s wird es wieder versucht; die Verfolgung läuft weiter.</translation>
    </message>
    <message>
        <source>left out</source>
        <translation>ausgelassen</translation>
    </message>
    <message>
        <source>A replay opens none of the rig&apos;s outputs: nothing old is sent anywhere unasked.</source>
        <translation>Eine Wiedergabe öffnet keine Ausgabe des Rigs: Nichts Altes wird ungefragt irgendwohin gesendet.</translation>
    </message>
    <message>
        <source>The installed plug-in {name}.</source>
        <translation>Das installierte Plug-in {name}.</translation>
    </message>
    <message>
        <source>output {spec!r}: it is in the list already.</source>
        <translation>Ausgabe {spec!r}: steht schon in der Liste.</translation>
    </message>
    <message>
        <source>at most {rate:g} states/s</source>
        <translation>höchstens {rate:g} Zustände/s</translation>
    </message>
    <message>
        <source>{joints} joints, {rate}</source>
        <translation>{joints} Gelenke, {rate}</translation>
    </message>
    <message>
        <source>; asked for when the engine was started</source>
        <translation>; beim Start der Engine verlangt</translation>
    </message>
    <message>
        <source>{sent} states sent, {dropped} dropped.</source>
        <translation>{sent} Zustände gesendet, {dropped} entfallen.</translation>
    </message>
    <message>
        <source>waits for a browser</source>
        <translation>wartet auf einen Browser</translation>
    </message>
    <message>
        <source>waits for a client</source>
        <translation>wartet auf einen Empfänger</translation>
    </message>
    <message numerus="yes">
        <source>, {n} client</source>
        <comment>, {n} clients</comment>
        <translation>
            <numerusform>, {n} Empfänger</numerusform>
            <numerusform>, {n} Empfänger</numerusform>
        </translation>
    </message>
    <message>
        <source>sending {rate:.0f} states/s{clients}</source>
        <translation>sendet {rate:.0f} Zustände/s{clients}</translation>
    </message>
    <message>
        <source>waits for a hand</source>
        <translation>wartet auf eine Hand</translation>
    </message>
    <message>
        <source>waits for Start</source>
        <translation>wartet auf Start</translation>
    </message>
    <message>
        <source>Whoever has this address sees the hand. The connection is encrypted, by a certificate that this computer made: the browser warns once; choose Advanced, then Proceed.</source>
        <translation>Wer diese Adresse hat, sieht die Hand. Die Verbindung ist verschlüsselt, mit einem Zertifikat dieses Rechners: Der Browser warnt einmal; Erweitert wählen, dann fortfahren.</translation>
    </message>
    <message>
        <source>Open it in a browser on this computer. For a headset or telephone change the target to 0.0.0.0:{port}: other computers are let in, by HTTPS only.</source>
        <translation>In einem Browser auf diesem Rechner öffnen. Für ein Headset oder Telefon das Ziel in 0.0.0.0:{port} ändern: Andere Rechner kommen dann herein, nur per HTTPS.</translation>
    </message>
    <message>
        <source>It lasts for this run: the simulated rig is made anew each time.</source>
        <translation>Gilt für diesen Lauf: Das simulierte Rig entsteht jedes Mal neu.</translation>
    </message>
    <message>
        <source>It lasts until the engine ends: this rig came from no file.</source>
        <translation>Gilt, bis die Engine endet: Dieses Rig kam aus keiner Datei.</translation>
    </message>
    <message>
        <source>Save rig (Ctrl+S) keeps it in {name}.</source>
        <translation>Rig speichern (Strg+S) behält es in {name}.</translation>
    </message>
    <message>
        <source>output {spec!r}: it is not in the engine&apos;s rig any more; another program has changed it.</source>
        <translation>Ausgabe {spec!r}: nicht mehr im Rig der Engine; ein anderes Programm hat es geändert.</translation>
    </message>
    <message>
        <source>Another program has changed the outputs since; nothing was taken back.</source>
        <translation>Ein anderes Programm hat die Ausgaben inzwischen geändert; nichts wurde zurückgenommen.</translation>
    </message>
    <message>
        <source>Three-dimensional scene of the mouse: ground, cursor and balls</source>
        <translation>Dreidimensionale Szene der Maus: Boden, Zeiger und Kugeln</translation>
    </message>
    <message>
        <source>Thumb</source>
        <translation>Daumen</translation>
    </message>
    <message>
        <source>Little finger</source>
        <translation>Kleiner Finger</translation>
    </message>
    <message>
        <source>No engine is heard, so no hand moves the mouse. Open a rig, or the simulated rig, in the main window and press Start.</source>
        <translation>Keine Engine ist zu hören, daher bewegt keine Hand die Maus. Im Hauptfenster ein Rig oder das simulierte Rig öffnen und Start drücken.</translation>
    </message>
    <message>
        <source>3-D mouse</source>
        <translation>3-D-Maus</translation>
    </message>
    <message>
        <source>Rest here</source>
        <translation>Hier ruhen</translation>
    </message>
    <message>
        <source>The hand as it lies for the next half second becomes the cursor&apos;s origin (H).</source>
        <translation>Die Hand, wie sie in der nächsten halben Sekunde liegt, wird zum Ursprung des Zeigers (H).</translation>
    </message>
    <message>
        <source>Take the last move of a ball back (Ctrl+Z).</source>
        <translation>Die letzte Bewegung einer Kugel zurücknehmen (Strg+Z).</translation>
    </message>
    <message>
        <source>Target test</source>
        <translation>Zieltest</translation>
    </message>
    <message>
        <source>Click nine targets with the thumb: how many bits per second the hand conveys (T).</source>
        <translation>Neun Ziele mit dem Daumen anklicken: wie viele Bit pro Sekunde die Hand überträgt (T).</translation>
    </message>
    <message>
        <source>What sets the pole&apos;s length: the index fingertip above the palm, or the palm.</source>
        <translation>Was die Länge der Stange bestimmt: die Zeigefingerspitze über der Handfläche oder die Handfläche.</translation>
    </message>
    <message>
        <source>Height from</source>
        <translation>Höhe von</translation>
    </message>
    <message>
        <source>Height from the index finger</source>
        <translation>Höhe vom Zeigefinger</translation>
    </message>
    <message>
        <source>Height from the palm</source>
        <translation>Höhe von der Handfläche</translation>
    </message>
    <message>
        <source>Cursor: right and forward of the ground&apos;s middle, and above it.</source>
        <translation>Zeiger: rechts und vor der Mitte des Bodens und darüber.</translation>
    </message>
    <message>
        <source>Pressed while the {finger} is spread away from the hand.</source>
        <translation>Gedrückt, solange der {finger} von der Hand abgespreizt ist.</translation>
    </message>
    <message>
        <source>Hold the hand still.</source>
        <translation>Die Hand still halten.</translation>
    </message>
    <message>
        <source>The target test moves no ball. End it to undo moves.</source>
        <translation>Der Zieltest bewegt keine Kugel. Ihn beenden, um Bewegungen zurückzunehmen.</translation>
    </message>
    <message>
        <source>End the test</source>
        <translation>Test beenden</translation>
    </message>
    <message>
        <source>Hold the hand still for half a second: that becomes the cursor&apos;s origin.</source>
        <translation>Die Hand eine halbe Sekunde still halten: Das wird der Ursprung des Zeigers.</translation>
    </message>
    <message>
        <source>right – mm   forward – mm   height – mm</source>
        <translation>rechts – mm   vorn – mm   Höhe – mm</translation>
    </message>
    <message>
        <source>right {right:+4.0f} mm   forward {forward:+4.0f} mm   height {height:3.0f} mm</source>
        <translation>rechts {right:+4.0f} mm   vorn {forward:+4.0f} mm   Höhe {height:3.0f} mm</translation>
    </message>
    <message>
        <source>DOWN</source>
        <translation>UNTEN</translation>
    </message>
    <message>
        <source>up</source>
        <translation>oben</translation>
    </message>
    <message>
        <source>Move the cursor&apos;s foot into the blue target and spread the thumb.</source>
        <translation>Den Fuß des Zeigers in das blaue Ziel bewegen und den Daumen spreizen.</translation>
    </message>
    <message>
        <source>Done: {sentence}</source>
        <translation>Fertig: {sentence}</translation>
    </message>
    <message>
        <source>The {name} moves with the cursor until the thumb returns.</source>
        <translation>{name}: bewegt sich mit dem Zeiger, bis der Daumen zurückkehrt.</translation>
    </message>
    <message>
        <source>Spread the thumb to pick the {name}, the little finger to put it on the ground.</source>
        <translation>{name}: mit gespreiztem Daumen greifen, mit dem kleinen Finger auf den Boden legen.</translation>
    </message>
    <message>
        <source>Bring the cursor to a ball.</source>
        <translation>Den Zeiger zu einer Kugel bringen.</translation>
    </message>
    <message>
        <source>Camera {name}: the picture nearest to this moment, and the tracked hand. Dotted bones are guessed.</source>
        <translation>Kamera {name}: das Bild, das diesem Moment am nächsten ist, und die verfolgte Hand. Gepunktete Knochen sind geraten.</translation>
    </message>
    <message>
        <source>Films of a bare hand by one camera, or by several at the same time. The hand networks find its landmarks; the tracked hand is then shown beside the pictures. Several films need the rig file that says where their cameras stand; one film is tracked without, at a distance that is a guess.</source>
        <translation>Filme einer bloßen Hand von einer Kamera oder von mehreren zugleich. Die Hand-Netze finden ihre Landmarken; die verfolgte Hand erscheint dann neben den Bildern. Mehrere Filme brauchen die Rig-Datei, die sagt, wo ihre Kameras stehen; ein Film wird ohne sie verfolgt, in einem geratenen Abstand.</translation>
    </message>
    <message>
        <source>Track films</source>
        <translation>Filme verfolgen</translation>
    </message>
    <message>
        <source>The rig of the films&apos; cameras</source>
        <translation>Das Rig der Kameras der Filme</translation>
    </message>
    <message>
        <source>none: one film, its lens assumed</source>
        <translation>keines: ein Film, mit angenommenem Objektiv</translation>
    </message>
    <message>
        <source>No rig</source>
        <translation>Kein Rig</translation>
    </message>
    <message>
        <source>Film</source>
        <translation>Film</translation>
    </message>
    <message>
        <source>Begins later by</source>
        <translation>Beginnt später um</translation>
    </message>
    <message>
        <source>Add films …</source>
        <translation>Filme hinzufügen …</translation>
    </message>
    <message>
        <source>Add a folder …</source>
        <translation>Ordner hinzufügen …</translation>
    </message>
    <message>
        <source>All films in a folder, in the order of their names.</source>
        <translation>Alle Filme eines Ordners, nach Namen geordnet.</translation>
    </message>
    <message>
        <source>Take the chosen film off the list (Delete); the file stays.</source>
        <translation>Den gewählten Film von der Liste nehmen (Entf); die Datei bleibt.</translation>
    </message>
    <message>
        <source>Align by sound</source>
        <translation>Nach Ton ausrichten</translation>
    </message>
    <message>
        <source>Align by a flash</source>
        <translation>Nach Blitz ausrichten</translation>
    </message>
    <message>
        <source>Find by how much later each film began: what all of them heard, such as a clap.</source>
        <translation>Finden, um wie viel später jeder Film begann: durch etwas, das alle hörten, etwa ein Klatschen.</translation>
    </message>
    <message>
        <source>Find by how much later each film began: a lamp that goes on in all of them.</source>
        <translation>Finden, um wie viel später jeder Film begann: durch eine Lampe, die in allen angeht.</translation>
    </message>
    <message>
        <source>Track …</source>
        <translation>Verfolgen …</translation>
    </message>
    <message>
        <source>Choose where the recording is written; it opens when it is whole.</source>
        <translation>Auswählen, wohin die Aufnahme geschrieben wird; sie öffnet sich, wenn sie vollständig ist.</translation>
    </message>
    <message>
        <source>By how much this film began after the others.</source>
        <translation>Um wie viel dieser Film nach den anderen begann.</translation>
    </message>
    <message>
        <source>Films</source>
        <translation>Filme</translation>
    </message>
    <message>
        <source>Films ({names});;All files (*)</source>
        <translation>Filme ({names});;Alle Dateien (*)</translation>
    </message>
    <message>
        <source>A folder of films</source>
        <translation>Ein Ordner mit Filmen</translation>
    </message>
    <message>
        <source>{name} holds no films ({names}).</source>
        <translation>{name} enthält keine Filme ({names}).</translation>
    </message>
    <message>
        <source>no film</source>
        <translation>kein Film</translation>
    </message>
    <message>
        <source>Add the film of a hand, or those of several cameras.</source>
        <translation>Den Film einer Hand hinzufügen oder die mehrerer Kameras.</translation>
    </message>
    <message>
        <source>Several films need the rig of their cameras: choose its file, or remove all films but one.</source>
        <translation>Mehrere Filme brauchen das Rig ihrer Kameras: seine Datei auswählen oder alle Filme bis auf einen entfernen.</translation>
    </message>
    <message>
        <source>Camera {twice} has two films: choose another camera for one of them.</source>
        <translation>Kamera {twice} hat zwei Filme: für einen davon eine andere Kamera wählen.</translation>
    </message>
    <message>
        <source>Ready. Looking for hands takes about as long as the films.</source>
        <translation>Bereit. Die Suche nach Händen dauert etwa so lange wie die Filme.</translation>
    </message>
    <message>
        <source>Write the recording to</source>
        <translation>Die Aufnahme schreiben nach</translation>
    </message>
    <message>
        <source>Aligned: {offsets}.</source>
        <translation>Ausgerichtet: {offsets}.</translation>
    </message>
    <message>
        <source>It holds no datagrams: nothing was streaming.</source>
        <translation>Sie enthält keine Datagramme: Nichts wurde gesendet.</translation>
    </message>
    <message>
        <source>“{name}” is no name for a recording: use letters, figures, blanks, dots and dashes, no slash, and no dot at the beginning.</source>
        <translation>„{name}“ ist kein Name für eine Aufnahme: Buchstaben, Ziffern, Leerzeichen, Punkte und Striche benutzen, keinen Schrägstrich und keinen Punkt am Anfang.</translation>
    </message>
    <message>
        <source>there is a recording called {name} already; choose another name.</source>
        <translation>es gibt schon eine Aufnahme namens {name}; einen anderen Namen wählen.</translation>
    </message>
    <message>
        <source>{trash}: cannot be made ({strerror}), so nothing was deleted.</source>
        <translation>{trash}: lässt sich nicht anlegen ({strerror}), daher wurde nichts gelöscht.</translation>
    </message>
    <message>
        <source>there is another recording called {stem} now; rename it first.</source>
        <translation>es gibt jetzt eine andere Aufnahme namens {stem}; sie zuerst umbenennen.</translation>
    </message>
    <message>
        <source>{stem} is being recorded; stop the recording first.</source>
        <translation>{stem} wird gerade aufgenommen; die Aufnahme zuerst beenden.</translation>
    </message>
    <message>
        <source>{path}: cannot be read ({strerror}).</source>
        <translation>{path}: nicht lesbar ({strerror}).</translation>
    </message>
    <message>
        <source>there are videos of another recording called {stem} already; move them first.</source>
        <translation>es gibt schon Videos einer anderen Aufnahme namens {stem}; sie zuerst verschieben.</translation>
    </message>
    <message>
        <source>{path}: cannot be moved to {target} ({strerror}).</source>
        <translation>{path}: lässt sich nicht nach {target} verschieben ({strerror}).</translation>
    </message>
    <message>
        <source>cannot be read</source>
        <translation>nicht lesbar</translation>
    </message>
    <message>
        <source>{states} states, {bookmarks} bookmarks. Green and full: tracking; yellow: partial; red and low: lost; empty: no state.</source>
        <translation>{states} Zustände, {bookmarks} Lesezeichen. Grün und voll: verfolgt; gelb: teilweise; rot und niedrig: verloren; leer: kein Zustand.</translation>
    </message>
    <message>
        <source>Name</source>
        <translation>Name</translation>
    </message>
    <message>
        <source>Date</source>
        <translation>Datum</translation>
    </message>
    <message>
        <source>Length</source>
        <translation>Länge</translation>
    </message>
    <message>
        <source>Condition</source>
        <translation>Zustand</translation>
    </message>
    <message>
        <source>The recordings</source>
        <translation>Die Aufnahmen</translation>
    </message>
    <message>
        <source>No recordings yet. Press Record, or R, while a rig is open.</source>
        <translation>Noch keine Aufnahmen. Aufnehmen oder R drücken, während ein Rig geöffnet ist.</translation>
    </message>
    <message>
        <source>Track the recording and play it (Enter).</source>
        <translation>Die Aufnahme verfolgen und abspielen (Eingabe).</translation>
    </message>
    <message>
        <source>Rename</source>
        <translation>Umbenennen</translation>
    </message>
    <message>
        <source>Call the recording something else (F2).</source>
        <translation>Die Aufnahme anders nennen (F2).</translation>
    </message>
    <message>
        <source>Delete</source>
        <translation>Löschen</translation>
    </message>
    <message>
        <source>Delete the recording; Undo brings it back until this page is closed (Delete).</source>
        <translation>Die Aufnahme löschen; Rückgängig holt sie zurück, bis diese Seite geschlossen wird (Entf).</translation>
    </message>
    <message>
        <source>Bring back the recording that was deleted last (Ctrl+Z).</source>
        <translation>Die zuletzt gelöschte Aufnahme zurückholen (Strg+Z).</translation>
    </message>
    <message>
        <source>Collect video</source>
        <translation>Video abholen</translation>
    </message>
    <message>
        <source>Fetch the frames that the cameras recorded beside the recording; they come to lie beside it.</source>
        <translation>Die Bilder holen, die die Kameras neben der Aufnahme aufgezeichnet haben; sie liegen dann daneben.</translation>
    </message>
    <message>
        <source>Open folder</source>
        <translation>Ordner öffnen</translation>
    </message>
    <message>
        <source>Show the recordings in the desktop&apos;s file manager.</source>
        <translation>Die Aufnahmen in der Dateiverwaltung zeigen.</translation>
    </message>
    <message>
        <source>Close this page. What was deleted is then gone for good.</source>
        <translation>Diese Seite schließen. Gelöschtes ist dann endgültig weg.</translation>
    </message>
    <message>
        <source>Deleted {name}. Undo brings it back; it is gone for good when this page is closed.</source>
        <translation>{name} gelöscht. Rückgängig holt es zurück; es ist endgültig weg, wenn diese Seite schließt.</translation>
    </message>
    <message>
        <source>{stem} continues {continues}: the engine had stopped and was started again.</source>
        <translation>{stem} setzt {continues} fort: Die Engine war stehen geblieben und wurde neu gestartet.</translation>
    </message>
    <message>
        <source>Collected {names}.</source>
        <translation>{names} abgeholt.</translation>
    </message>
    <message>
        <source> The cameras&apos; computers were too slow for {dropped} frames.</source>
        <translation> Die Rechner der Kameras waren für {dropped} Bilder zu langsam.</translation>
    </message>
    <message>
        <source>Asking the nodes …</source>
        <translation>Die Knoten werden gefragt …</translation>
    </message>
    <message>
        <source>This desktop opens no folders. The recordings lie in {folder}.</source>
        <translation>Dieser Desktop öffnet keine Ordner. Die Aufnahmen liegen in {folder}.</translation>
    </message>
    <message>
        <source>Preparing the tracker …</source>
        <translation>Der Tracker wird vorbereitet …</translation>
    </message>
    <message>
        <source>{out}: the states of the recording cannot be written ({strerror}). They take about 5 kB each; make room there.</source>
        <translation>{out}: Die Zustände der Aufnahme lassen sich nicht schreiben ({strerror}). Sie brauchen je etwa 5 kB; dort Platz schaffen.</translation>
    </message>
    <message>
        <source>it holds no datagrams: nothing was streaming while it was recorded. There is nothing to replay.</source>
        <translation>enthält keine Datagramme: Während der Aufnahme wurde nichts gesendet. Es gibt nichts abzuspielen.</translation>
    </message>
    <message>
        <source>no state could be made of its {datagrams} datagrams. Is this the rig that it was recorded with, and were both cameras streaming?</source>
        <translation>aus den {datagrams} Datagrammen ließ sich kein Zustand bilden. Ist es das Rig, mit dem aufgenommen wurde, und haben beide Kameras gesendet?</translation>
    </message>
    <message>
        <source>Tracking the recording …</source>
        <translation>Die Aufnahme wird verfolgt …</translation>
    </message>
    <message>
        <source>{path} is still being recorded: what was written until now is shown.</source>
        <translation>{path} wird noch aufgenommen: Gezeigt wird, was bis jetzt geschrieben ist.</translation>
    </message>
    <message>
        <source>In {path} {damage}.</source>
        <translation>In {path} {damage}.</translation>
    </message>
    <message>
        <source>Of {path} {end}.</source>
        <translation>Von {path} {end}.</translation>
    </message>
    <message>
        <source>Everything else is shown.</source>
        <translation>Alles andere wird gezeigt.</translation>
    </message>
    <message>
        <source>{folder}: cannot be made ({strerror}), so there is no room for the states.</source>
        <translation>{folder}: lässt sich nicht anlegen ({strerror}), daher ist kein Platz für die Zustände.</translation>
    </message>
    <message>
        <source>as the rig says</source>
        <translation>wie das Rig sagt</translation>
    </message>
    <message>
        <source>As recorded</source>
        <translation>Wie aufgenommen</translation>
    </message>
    <message>
        <source>JSON files (*.json);;All files (*)</source>
        <translation>JSON-Dateien (*.json);;Alle Dateien (*)</translation>
    </message>
    <message>
        <source>Compare with another run</source>
        <translation>Mit einem anderen Lauf vergleichen</translation>
    </message>
    <message>
        <source>Track again</source>
        <translation>Noch einmal verfolgen</translation>
    </message>
    <message>
        <source>The recording is tracked once more, and both hands are shown together.</source>
        <translation>Die Aufnahme wird noch einmal verfolgt, und beide Hände werden zusammen gezeigt.</translation>
    </message>
    <message>
        <source>The recording is tracked once more; the moment that is shown stays.</source>
        <translation>Die Aufnahme wird noch einmal verfolgt; der gezeigte Moment bleibt.</translation>
    </message>
    <message>
        <source>Track with a rig file</source>
        <translation>Mit einer Rig-Datei verfolgen</translation>
    </message>
    <message>
        <source>Track with a hand file</source>
        <translation>Mit einer Handdatei verfolgen</translation>
    </message>
    <message>
        <source>the rig&apos;s hand</source>
        <translation>die Hand des Rigs</translation>
    </message>
    <message>
        <source>Track</source>
        <translation>Verfolgen</translation>
    </message>
    <message>
        <source>Reading the recording …</source>
        <translation>Die Aufnahme wird gelesen …</translation>
    </message>
    <message>
        <source>Fingertip difference</source>
        <translation>Abstand der Fingerspitzen</translation>
    </message>
    <message>
        <source>The beginning (Home).</source>
        <translation>Der Anfang (Pos1).</translation>
    </message>
    <message>
        <source>One state back (left arrow).</source>
        <translation>Einen Zustand zurück (Pfeil links).</translation>
    </message>
    <message>
        <source>Play or pause (Space).</source>
        <translation>Abspielen oder anhalten (Leertaste).</translation>
    </message>
    <message>
        <source>One state on (right arrow).</source>
        <translation>Einen Zustand weiter (Pfeil rechts).</translation>
    </message>
    <message>
        <source>The end (End).</source>
        <translation>Das Ende (Ende).</translation>
    </message>
    <message>
        <source>How fast it plays, times real time.</source>
        <translation>Wie schnell abgespielt wird, als Vielfaches der Echtzeit.</translation>
    </message>
    <message>
        <source>Loop from here</source>
        <translation>Schleife ab</translation>
    </message>
    <message>
        <source>The range that is repeated begins here ([).</source>
        <translation>Der wiederholte Bereich beginnt hier ([).</translation>
    </message>
    <message>
        <source>to here</source>
        <translation>bis</translation>
    </message>
    <message>
        <source>The range that is repeated ends here (]).</source>
        <translation>Der wiederholte Bereich endet hier (]).</translation>
    </message>
    <message>
        <source>No loop</source>
        <translation>Keine Schleife</translation>
    </message>
    <message>
        <source>Repeat nothing.</source>
        <translation>Nichts wiederholen.</translation>
    </message>
    <message>
        <source>Write a few words about this moment into the recording (B).</source>
        <translation>Ein paar Worte über diesen Augenblick in die Aufnahme schreiben (B).</translation>
    </message>
    <message>
        <source>classic tracker</source>
        <translation>klassischer Tracker</translation>
    </message>
    <message>
        <source>smoothed</source>
        <translation>geglättet</translation>
    </message>
    <message>
        <source>{time} of {length}, state {number} of {count}</source>
        <translation>{time} von {length}, Zustand {number} von {count}</translation>
    </message>
    <message>
        <source>waiting …</source>
        <translation>wartet …</translation>
    </message>
    <message>
        <source>tracking</source>
        <translation>verfolgt</translation>
    </message>
    <message>
        <source>partial</source>
        <translation>teilweise</translation>
    </message>
    <message>
        <source>no state</source>
        <translation>kein Zustand</translation>
    </message>
    <message>
        <source>Timeline of the recording</source>
        <translation>Zeitleiste der Aufnahme</translation>
    </message>
    <message>
        <source>Replay</source>
        <translation>Wiedergabe</translation>
    </message>
    <message>
        <source>REPLAY</source>
        <translation>WIEDERGABE</translation>
    </message>
    <message>
        <source>Open …</source>
        <translation>Öffnen …</translation>
    </message>
    <message>
        <source>Open a recording (Ctrl+O).</source>
        <translation>Eine Aufnahme öffnen (Strg+O).</translation>
    </message>
    <message>
        <source>Track again …</source>
        <translation>Noch einmal verfolgen …</translation>
    </message>
    <message>
        <source>Track the recording with another tracker, rig or hand.</source>
        <translation>Die Aufnahme mit einem anderen Tracker, Rig oder einer anderen Hand verfolgen.</translation>
    </message>
    <message>
        <source>Compare …</source>
        <translation>Vergleichen …</translation>
    </message>
    <message>
        <source>Track it in another way too, and show both hands together.</source>
        <translation>Sie auch auf andere Weise verfolgen und beide Hände zusammen zeigen.</translation>
    </message>
    <message>
        <source>End comparison</source>
        <translation>Vergleich beenden</translation>
    </message>
    <message>
        <source>Show one run alone again.</source>
        <translation>Wieder nur einen Lauf zeigen.</translation>
    </message>
    <message>
        <source>Write these states as a file for other programs (Ctrl+E).</source>
        <translation>Diese Zustände als Datei für andere Programme schreiben (Strg+E).</translation>
    </message>
    <message>
        <source>Trim …</source>
        <translation>Zuschneiden …</translation>
    </message>
    <message>
        <source>Save the repeated range as a recording of its own.</source>
        <translation>Den wiederholten Bereich als eigene Aufnahme speichern.</translation>
    </message>
    <message>
        <source>Pictures</source>
        <translation>Bilder</translation>
    </message>
    <message>
        <source>What the cameras saw, with the hand drawn over it (P).</source>
        <translation>Was die Kameras sahen, mit der Hand darüber gezeichnet (P).</translation>
    </message>
    <message>
        <source>Remove the bookmark here</source>
        <translation>Lesezeichen hier entfernen</translation>
    </message>
    <message>
        <source>Remove the bookmark at which the recording stands.</source>
        <translation>Das Lesezeichen entfernen, bei dem die Aufnahme steht.</translation>
    </message>
    <message>
        <source>Bookmarks</source>
        <translation>Lesezeichen</translation>
    </message>
    <message>
        <source>Moments that were marked, while recording or here; choose one to go there.</source>
        <translation>Momente, die beim Aufnehmen oder hier markiert wurden; einen auswählen, um dorthin zu gehen.</translation>
    </message>
    <message>
        <source>no recording</source>
        <translation>keine Aufnahme</translation>
    </message>
    <message>
        <source>No bookmarks yet: B sets one.</source>
        <translation>Noch keine Lesezeichen: B setzt eines.</translation>
    </message>
    <message>
        <source>NO STATE</source>
        <translation>KEIN ZUSTAND</translation>
    </message>
    <message>
        <source>The recording has no state at this moment.</source>
        <translation>Die Aufnahme hat in diesem Moment keinen Zustand.</translation>
    </message>
    <message>
        <source>RHOT replay</source>
        <translation>RHOT-Wiedergabe</translation>
    </message>
    <message>
        <source>Open a recording</source>
        <translation>Eine Aufnahme öffnen</translation>
    </message>
    <message>
        <source>{name} – RHOT replay</source>
        <translation>{name} – RHOT-Wiedergabe</translation>
    </message>
    <message>
        <source>No video of this recording is on this computer. Rig, Recordings, Collect video fetches what the nodes recorded.</source>
        <translation>Auf diesem Rechner ist kein Video dieser Aufnahme. Rig, Aufnahmen, Video abholen holt, was die Knoten aufgezeichnet haben.</translation>
    </message>
    <message>
        <source>Choose the part first: [ and ] set where the repeated range begins and ends.</source>
        <translation>Zuerst den Teil wählen: [ und ] setzen Anfang und Ende des wiederholten Bereichs.</translation>
    </message>
    <message>
        <source>Save the repeated range as</source>
        <translation>Den wiederholten Bereich speichern als</translation>
    </message>
    <message>
        <source>Saving {name} …</source>
        <translation>{name} wird gespeichert …</translation>
    </message>
    <message numerus="yes">
        <source> and {n} video</source>
        <comment> and {n} videos</comment>
        <translation>
            <numerusform> und {n} Video</numerusform>
            <numerusform> und {n} Videos</numerusform>
        </translation>
    </message>
    <message>
        <source>Saved {path}{films}. Open it with Ctrl+O.</source>
        <translation>{path}{films} gespeichert. Mit Strg+O öffnen.</translation>
    </message>
    <message>
        <source>One moment. Cancel leaves nothing behind.</source>
        <translation>Einen Moment. Abbrechen hinterlässt nichts.</translation>
    </message>
    <message>
        <source>Open a recording (Ctrl+O). F1 opens the guide.</source>
        <translation>Eine Aufnahme öffnen (Strg+O). F1 öffnet die Anleitung.</translation>
    </message>
    <message>
        <source>Solid: {first}. Blue and translucent: {second}.</source>
        <translation>Voll: {first}. Blau und durchscheinend: {second}.</translation>
    </message>
    <message>
        <source>Tracked {text}. Space plays, the arrow keys go from state to state.</source>
        <translation>Verfolgt: {text}. Die Leertaste spielt ab, die Pfeiltasten gehen von Zustand zu Zustand.</translation>
    </message>
    <message>
        <source>Set the cameras</source>
        <translation>Kameras einstellen</translation>
    </message>
    <message>
        <source>Exposure, gains, white balance: what each camera is told, tried out live.</source>
        <translation>Belichtung, Verstärkung, Weißabgleich: was jeder Kamera gesagt wird, live ausprobiert.</translation>
    </message>
    <message>
        <source>Intrinsics of a camera</source>
        <translation>Intrinsik einer Kamera</translation>
    </message>
    <message>
        <source>Focal length, centre and distortion of one camera&apos;s lens, from a board that is held all over its picture.</source>
        <translation>Brennweite, Hauptpunkt und Verzeichnung des Objektivs einer Kamera, aus einem Brett, das überall in ihr Bild gehalten wird.</translation>
    </message>
    <message>
        <source>Stereo calibration</source>
        <translation>Stereokalibrierung</translation>
    </message>
    <message>
        <source>Where the cameras stand to each other and to the table, from a board that they see at the same time.</source>
        <translation>Wie die Kameras zueinander und zum Tisch stehen, aus einem Brett, das sie gleichzeitig sehen.</translation>
    </message>
    <message>
        <source>Use refined calibration</source>
        <translation>Verfeinerte Kalibrierung benutzen</translation>
    </message>
    <message>
        <source>How the cameras stand now, from the hand that moves while it is tracked.</source>
        <translation>Wie die Kameras jetzt stehen, aus der Hand, die sich bewegt, während sie verfolgt wird.</translation>
    </message>
    <message>
        <source>Colours of the markers</source>
        <translation>Farben der Marker</translation>
    </message>
    <message>
        <source>Which colour each marker has, and what may be mistaken for it.</source>
        <translation>Welche Farbe jeder Marker hat und was mit ihm verwechselt werden kann.</translation>
    </message>
    <message>
        <source>Background and skin</source>
        <translation>Hintergrund und Haut</translation>
    </message>
    <message>
        <source>What the empty scene and your skin look like, so that a bare hand can be tracked.</source>
        <translation>Wie die leere Szene und die Haut aussehen, damit eine bloße Hand verfolgt werden kann.</translation>
    </message>
    <message>
        <source>Adapt the hand&apos;s shape</source>
        <translation>Form der Hand anpassen</translation>
    </message>
    <message>
        <source>How long and how thick the fingers are, from a bare hand that moves while it is tracked.</source>
        <translation>Wie lang und wie dick die Finger sind, aus einer bloßen Hand, die sich bewegt, während sie verfolgt wird.</translation>
    </message>
    <message>
        <source>Use measured bones</source>
        <translation>Gemessene Knochen benutzen</translation>
    </message>
    <message>
        <source>How long the bones are, from the landmarks of a hand that two cameras see while it is tracked.</source>
        <translation>Wie lang die Knochen sind, aus den Landmarken einer Hand, die zwei Kameras sehen, während sie verfolgt wird.</translation>
    </message>
    <message>
        <source>Time of the cameras</source>
        <translation>Zeit der Kameras</translation>
    </message>
    <message>
        <source>When each camera sees, from a hand that waves.</source>
        <translation>Wann jede Kamera sieht, aus einer Hand, die winkt.</translation>
    </message>
    <message>
        <source>Depth without a board</source>
        <translation>Tiefe ohne Brett</translation>
    </message>
    <message>
        <source>Distance from disparity, from a marker at measured distances.</source>
        <translation>Abstand aus Disparität, aus einem Marker in gemessenen Abständen.</translation>
    </message>
    <message>
        <source>Bones of the hand</source>
        <translation>Knochen der Hand</translation>
    </message>
    <message>
        <source>How long the bones are, from a minute of movement or by a ruler.</source>
        <translation>Wie lang die Knochen sind, aus einer Minute Bewegung oder mit dem Lineal.</translation>
    </message>
    <message>
        <source>Filters</source>
        <translation>Filter</translation>
    </message>
    <message>
        <source>How much jitter and how much lag, from a hand held still and one that moves fast.</source>
        <translation>Wie viel Jitter und wie viel Verzögerung, aus einer ruhig gehaltenen Hand und einer schnellen.</translation>
    </message>
    <message>
        <source>Alignment with another tracker</source>
        <translation>Ausrichtung an einem anderen Tracker</translation>
    </message>
    <message>
        <source>Where a Vive tracker&apos;s world is in the rig, from a movement of both.</source>
        <translation>Wo die Welt eines Vive-Trackers im Rig liegt, aus einer gemeinsamen Bewegung.</translation>
    </message>
    <message>
        <source>Certificate</source>
        <translation>Zertifikat</translation>
    </message>
    <message>
        <source>How good this rig is, measured as the thesis did, with 95 % intervals: five minutes.</source>
        <translation>Wie gut dieses Rig ist, gemessen wie in der Arbeit, mit 95-%-Intervallen: fünf Minuten.</translation>
    </message>
    <message>
        <source>Move the hand</source>
        <translation>Die Hand bewegen</translation>
    </message>
    <message>
        <source>Start the tracking and move the hand through both pictures, near and far.</source>
        <translation>Die Verfolgung starten und die Hand durch beide Bilder bewegen, nah und fern.</translation>
    </message>
    <message>
        <source>The calibration in force still holds, or too little of the hand was seen.</source>
        <translation>Die geltende Kalibrierung stimmt noch, oder von der Hand war zu wenig zu sehen.</translation>
    </message>
    <message>
        <source>Show the hand</source>
        <translation>Die Hand zeigen</translation>
    </message>
    <message>
        <source>Start the tracking of a bare hand by its contours. Spread and bend every finger, and turn the hand.</source>
        <translation>Die Verfolgung einer bloßen Hand an ihren Konturen starten. Jeden Finger spreizen und beugen und die Hand drehen.</translation>
    </message>
    <message>
        <source>Too little of the hand was seen.</source>
        <translation>Von der Hand war zu wenig zu sehen.</translation>
    </message>
    <message>
        <source>Start the tracking by landmarks. Show the open hand to two cameras for some seconds, and turn it.</source>
        <translation>Die Verfolgung durch Landmarken starten. Die offene Hand einige Sekunden lang zwei Kameras zeigen und drehen.</translation>
    </message>
    <message>
        <source>Two cameras have not yet seen enough of the hand.</source>
        <translation>Zwei Kameras haben noch nicht genug von der Hand gesehen.</translation>
    </message>
    <message>
        <source>Wave</source>
        <translation>Winken</translation>
    </message>
    <message>
        <source>Press Record, then wave your hand up and down before the cameras for 20 seconds.</source>
        <translation>Aufnehmen drücken, dann die Hand 20 Sekunden lang vor den Kameras auf und ab bewegen.</translation>
    </message>
    <message>
        <source>brisk</source>
        <translation>flott</translation>
    </message>
    <message>
        <source>The open hand waves briskly in a wide round, 30 cm across and 16 cm high. For filters and the cameras&apos; time.</source>
        <translation>Die offene Hand winkt flott in einem weiten Bogen, 30 cm breit und 16 cm hoch. Für Filter und die Zeit der Kameras.</translation>
    </message>
    <message>
        <source>cross</source>
        <translation>kreuzen</translation>
    </message>
    <message>
        <source>Fingers that cross in the pictures: index and middle over each other, little and ring, the thumb across the palm, the hand edge on.</source>
        <translation>Finger, die sich in den Bildern kreuzen: Zeige- und Mittelfinger, Klein- und Ringfinger, der Daumen über der Handfläche, die Hand hochkant.</translation>
    </message>
    <message>
        <source>BVH: a moving skeleton</source>
        <translation>BVH: ein bewegtes Skelett</translation>
    </message>
    <message>
        <source>C3D: points, motion capture</source>
        <translation>C3D: Punkte, Motion Capture</translation>
    </message>
    <message>
        <source>CSV: a table</source>
        <translation>CSV: eine Tabelle</translation>
    </message>
    <message>
        <source>glTF: an animated hand</source>
        <translation>glTF: eine animierte Hand</translation>
    </message>
    <message>
        <source>MCAP: for Foxglove</source>
        <translation>MCAP: für Foxglove</translation>
    </message>
    <message>
        <source>NPZ: NumPy&apos;s arrays</source>
        <translation>NPZ: Arrays von NumPy</translation>
    </message>
    <message>
        <source>Parquet: a table for analysis</source>
        <translation>Parquet: eine Tabelle zum Auswerten</translation>
    </message>
    <message>
        <source>MCAP: for ROS 2</source>
        <translation>MCAP: für ROS 2</translation>
    </message>
    <message>
        <source>TRC: points, for OpenSim</source>
        <translation>TRC: Punkte, für OpenSim</translation>
    </message>
    <message>
        <source>Index</source>
        <translation>Zeigefinger</translation>
    </message>
    <message>
        <source>Middle</source>
        <translation>Mittelfinger</translation>
    </message>
    <message>
        <source>Ring</source>
        <translation>Ringfinger</translation>
    </message>
    <message>
        <source>Little</source>
        <translation>Kleiner Finger</translation>
    </message>
    <message>
        <source>Forearm</source>
        <translation>Unterarm</translation>
    </message>
    <message>
        <source>Sizes</source>
        <translation>Größen</translation>
    </message>
    <message>
        <source>Lengths</source>
        <translation>Längen</translation>
    </message>
    <message>
        <source>Radii</source>
        <translation>Radien</translation>
    </message>
    <message>
        <source>Finger roots</source>
        <translation>Fingerwurzeln</translation>
    </message>
    <message>
        <source>CMC abduction</source>
        <translation>CMC Abduktion</translation>
    </message>
    <message>
        <source>CMC flexion</source>
        <translation>CMC Beugung</translation>
    </message>
    <message>
        <source>DIP flexion</source>
        <translation>DIP Beugung</translation>
    </message>
    <message>
        <source>From joint to joint; the last bone ends at the fingertip.</source>
        <translation>Von Gelenk zu Gelenk; der letzte Knochen endet an der Fingerspitze.</translation>
    </message>
    <message>
        <source>Half of the thickness.</source>
        <translation>Die Hälfte der Dicke.</translation>
    </message>
    <message>
        <source>IP flexion</source>
        <translation>IP Beugung</translation>
    </message>
    <message>
        <source>MCP abduction</source>
        <translation>MCP Abduktion</translation>
    </message>
    <message>
        <source>MCP flexion</source>
        <translation>MCP Beugung</translation>
    </message>
    <message>
        <source>Of the forearm behind the wrist.</source>
        <translation>Des Unterarms hinter dem Handgelenk.</translation>
    </message>
    <message>
        <source>Of the wrist in the rig&apos;s frame.</source>
        <translation>Des Handgelenks im Koordinatensystem des Rigs.</translation>
    </message>
    <message>
        <source>PIP flexion</source>
        <translation>PIP Beugung</translation>
    </message>
    <message>
        <source>Relative to the hand of the beginning: all phalanges, beside the size of the whole hand.</source>
        <translation>Im Verhältnis zur Hand des Anfangs: alle Fingerglieder, neben der Größe der ganzen Hand.</translation>
    </message>
    <message>
        <source>Relative to the hand of the beginning: all radii but the forearm&apos;s, and the palm&apos;s thickness.</source>
        <translation>Im Verhältnis zur Hand des Anfangs: alle Radien außer denen des Unterarms, und die Dicke der Handfläche.</translation>
    </message>
    <message>
        <source>Relative to the hand of the beginning: every length.</source>
        <translation>Im Verhältnis zur Hand des Anfangs: jede Länge.</translation>
    </message>
    <message>
        <source>Relative to the hand of the beginning: the forearm&apos;s thickness.</source>
        <translation>Im Verhältnis zur Hand des Anfangs: die Dicke des Unterarms.</translation>
    </message>
    <message>
        <source>The palm turns about its axes, z first, then y, then x.</source>
        <translation>Die Handfläche dreht sich um ihre Achsen, zuerst z, dann y, dann x.</translation>
    </message>
    <message>
        <source>Where the finger begins, from the wrist joint: towards the fingertips, towards the thumb, and out of the back of the hand.</source>
        <translation>Wo der Finger beginnt, vom Handgelenk aus: zu den Fingerspitzen hin, zum Daumen hin und aus dem Handrücken heraus.</translation>
    </message>
    <message>
        <source>Within the limits of the hand file.</source>
        <translation>Innerhalb der Grenzen der Handdatei.</translation>
    </message>
    <message>
        <source>deviation</source>
        <translation>Abweichung zur Seite</translation>
    </message>
    <message>
        <source>fingers</source>
        <translation>Finger</translation>
    </message>
    <message>
        <source>flexion</source>
        <translation>Beugung</translation>
    </message>
    <message>
        <source>forearm</source>
        <translation>Unterarm</translation>
    </message>
    <message>
        <source>index distal</source>
        <translation>Zeigefinger distal</translation>
    </message>
    <message>
        <source>index dorsal</source>
        <translation>Zeigefinger dorsal</translation>
    </message>
    <message>
        <source>index medial</source>
        <translation>Zeigefinger medial</translation>
    </message>
    <message>
        <source>index proximal</source>
        <translation>Zeigefinger proximal</translation>
    </message>
    <message>
        <source>index radial</source>
        <translation>Zeigefinger radial</translation>
    </message>
    <message>
        <source>little distal</source>
        <translation>kleiner Finger distal</translation>
    </message>
    <message>
        <source>little dorsal</source>
        <translation>kleiner Finger dorsal</translation>
    </message>
    <message>
        <source>little medial</source>
        <translation>kleiner Finger medial</translation>
    </message>
    <message>
        <source>little proximal</source>
        <translation>kleiner Finger proximal</translation>
    </message>
    <message>
        <source>little radial</source>
        <translation>kleiner Finger radial</translation>
    </message>
    <message>
        <source>middle distal</source>
        <translation>Mittelfinger distal</translation>
    </message>
    <message>
        <source>middle dorsal</source>
        <translation>Mittelfinger dorsal</translation>
    </message>
    <message>
        <source>middle medial</source>
        <translation>Mittelfinger medial</translation>
    </message>
    <message>
        <source>middle proximal</source>
        <translation>Mittelfinger proximal</translation>
    </message>
    <message>
        <source>middle radial</source>
        <translation>Mittelfinger radial</translation>
    </message>
    <message>
        <source>ring distal</source>
        <translation>Ringfinger distal</translation>
    </message>
    <message>
        <source>ring dorsal</source>
        <translation>Ringfinger dorsal</translation>
    </message>
    <message>
        <source>ring medial</source>
        <translation>Ringfinger medial</translation>
    </message>
    <message>
        <source>ring proximal</source>
        <translation>Ringfinger proximal</translation>
    </message>
    <message>
        <source>ring radial</source>
        <translation>Ringfinger radial</translation>
    </message>
    <message>
        <source>thickness</source>
        <translation>Dicke</translation>
    </message>
    <message>
        <source>thumb distal</source>
        <translation>Daumen distal</translation>
    </message>
    <message>
        <source>thumb dorsal</source>
        <translation>Daumen dorsal</translation>
    </message>
    <message>
        <source>thumb metacarpal</source>
        <translation>Daumen metakarpal</translation>
    </message>
    <message>
        <source>thumb proximal</source>
        <translation>Daumen proximal</translation>
    </message>
    <message>
        <source>thumb radial</source>
        <translation>Daumen radial</translation>
    </message>
    <message>
        <source>turn about x</source>
        <translation>Drehung um x</translation>
    </message>
    <message>
        <source>turn about y</source>
        <translation>Drehung um y</translation>
    </message>
    <message>
        <source>turn about z</source>
        <translation>Drehung um z</translation>
    </message>
    <message>
        <source>whole hand</source>
        <translation>ganze Hand</translation>
    </message>
    <message>
        <source>x</source>
        <translation>x</translation>
    </message>
    <message>
        <source>y</source>
        <translation>y</translation>
    </message>
    <message>
        <source>z</source>
        <translation>z</translation>
    </message>
    <message>
        <source>Hold still</source>
        <translation>Still halten</translation>
    </message>
    <message>
        <source>Rest the hand before both cameras, then press Record.</source>
        <translation>Die Hand vor beiden Kameras ruhen lassen, dann Aufnehmen drücken.</translation>
    </message>
    <message>
        <source>Holds still.</source>
        <translation>Hält still.</translation>
    </message>
    <message>
        <source>Move fast</source>
        <translation>Schnell bewegen</translation>
    </message>
    <message>
        <source>Press Record, then wave the hand briskly, 20 cm wide.</source>
        <translation>Aufnehmen drücken, dann die Hand flott winken, 20 cm weit.</translation>
    </message>
    <message>
        <source>Waves briskly.</source>
        <translation>Winkt flott.</translation>
    </message>
    <message>
        <source>Record both movements first.</source>
        <translation>Zuerst beide Bewegungen aufnehmen.</translation>
    </message>
    <message>
        <source>Trying filters …</source>
        <translation>Filter werden ausprobiert …</translation>
    </message>
    <message>
        <source>markers</source>
        <translation>Marker</translation>
    </message>
    <message>
        <source>markers that both cameras have seen so far</source>
        <translation>Marker, die beide Kameras bisher gesehen haben</translation>
    </message>
    <message>
        <source>Both cameras have not seen {names}.</source>
        <translation>Nicht von beiden Kameras gesehen: {names}.</translation>
    </message>
    <message>
        <source>of the time at rest that is needed</source>
        <translation>der nötigen Zeit in Ruhe</translation>
    </message>
    <message>
        <source>It moves: rest the hand on something.</source>
        <translation>Sie bewegt sich: die Hand auf etwas auflegen.</translation>
    </message>
    <message>
        <source>Good, hold still.</source>
        <translation>Gut, still halten.</translation>
    </message>
    <message>
        <source>The hand moved: rest it on something.</source>
        <translation>Die Hand hat sich bewegt: sie auf etwas auflegen.</translation>
    </message>
    <message>
        <source>of {brisk_m_s:.1f} m/s, the fastest marker of the last two seconds</source>
        <translation>von {brisk_m_s:.1f} m/s, der schnellste Marker der letzten zwei Sekunden</translation>
    </message>
    <message>
        <source>fast</source>
        <translation>schnell</translation>
    </message>
    <message>
        <source>of the time at that speed that is needed</source>
        <translation>der nötigen Zeit bei diesem Tempo</translation>
    </message>
    <message>
        <source>Faster, 20 cm wide.</source>
        <translation>Schneller, 20 cm weit.</translation>
    </message>
    <message>
        <source>The hand was too slow.</source>
        <translation>Die Hand war zu langsam.</translation>
    </message>
    <message>
        <source>raw</source>
        <translation>roh</translation>
    </message>
    <message>
        <source>filtered</source>
        <translation>gefiltert</translation>
    </message>
    <message>
        <source>lag</source>
        <translation>Verzug</translation>
    </message>
    <message>
        <source>after depth (positions)</source>
        <translation>nach der Tiefe (Orte)</translation>
    </message>
    <message>
        <source>before depth (pixels)</source>
        <translation>vor der Tiefe (Pixel)</translation>
    </message>
    <message>
        <source>Of the last two seconds: jitter without filters and, at rest, with those in force, mm rms; and how far the filters lag behind, ms, while a marker moves.</source>
        <translation>Der letzten zwei Sekunden: Jitter ohne Filter und, in Ruhe, mit den geltenden, mm rms; und wie weit die Filter nachhinken, ms, während sich ein Marker bewegt.</translation>
    </message>
    <message>
        <source>Jitter, mm, and lag, ms, of now</source>
        <translation>Jitter [mm], Verzug [ms], jetzt</translation>
    </message>
    <message>
        <source>How much a marker may jitter at rest, rms.</source>
        <translation>Wie stark ein Marker in Ruhe zittern darf, rms.</translation>
    </message>
    <message>
        <source>How far a fast marker may lag behind.</source>
        <translation>Wie weit ein schneller Marker nachhinken darf.</translation>
    </message>
    <message>
        <source>There are two filters: one smooths the pixels before distances are computed, the other the positions after it.</source>
        <translation>Es gibt zwei Filter: Einer glättet die Pixel, bevor Abstände berechnet werden, der andere danach die Orte.</translation>
    </message>
    <message>
        <source>each marker its own settings</source>
        <translation>eigene Einstellungen je Marker</translation>
    </message>
    <message>
        <source>Otherwise all markers get the settings that serve the worst of them.</source>
        <translation>Sonst bekommen alle Marker die Einstellungen, die dem schlechtesten genügen.</translation>
    </message>
    <message>
        <source>Jitter</source>
        <translation>Jitter</translation>
    </message>
    <message>
        <source>Lag</source>
        <translation>Verzögerung</translation>
    </message>
    <message>
        <source>Charts</source>
        <translation>Diagramme</translation>
    </message>
    <message>
        <source>A hurried figure of eight, 2 m/s at its peak.</source>
        <translation>Eine eilige Acht, in der Spitze 2 m/s.</translation>
    </message>
    <message>
        <source>grasp</source>
        <translation>greifen</translation>
    </message>
    <message>
        <source>Reaching out, closing the hand round a glass, holding it and letting go.</source>
        <translation>Ausstrecken, die Hand um ein Glas schließen, halten und loslassen.</translation>
    </message>
    <message>
        <source>mouse</source>
        <translation>Maus</translation>
    </message>
    <message>
        <source>The hand works the 3-D mouse: it picks three balls and carries them.</source>
        <translation>Die Hand bedient die 3-D-Maus: Sie greift drei Kugeln und trägt sie.</translation>
    </message>
    <message>
        <source>pinch</source>
        <translation>Pinzettengriff</translation>
    </message>
    <message>
        <source>Thumb and index meet, twice in a row, the other fingers stay half open.</source>
        <translation>Daumen und Zeigefinger berühren sich zweimal nacheinander, die anderen Finger bleiben halb offen.</translation>
    </message>
    <message>
        <source>point</source>
        <translation>zeigen</translation>
    </message>
    <message>
        <source>The index finger points and draws a small circle in the air.</source>
        <translation>Der Zeigefinger zeigt und zeichnet einen kleinen Kreis in die Luft.</translation>
    </message>
    <message>
        <source>rest</source>
        <translation>ruhen</translation>
    </message>
    <message>
        <source>A relaxed open hand, held as still as a person can.</source>
        <translation>Eine entspannte offene Hand, so ruhig gehalten, wie ein Mensch es kann.</translation>
    </message>
    <message>
        <source>roam</source>
        <translation>umher</translation>
    </message>
    <message>
        <source>The open hand moves and turns about all axes, irregularly. For aligning another tracker.</source>
        <translation>Die offene Hand bewegt und dreht sich unregelmäßig um alle Achsen. Zum Ausrichten eines anderen Trackers.</translation>
    </message>
    <message>
        <source>The fingers spread wide and close again.</source>
        <translation>Die Finger spreizen sich weit und schließen sich wieder.</translation>
    </message>
    <message>
        <source>still</source>
        <translation>starr</translation>
    </message>
    <message>
        <source>An open hand as if cast in plaster: no motion at all.</source>
        <translation>Eine offene Hand wie aus Gips: ohne jede Bewegung.</translation>
    </message>
    <message>
        <source>sweep</source>
        <translation>alle Gelenke</translation>
    </message>
    <message>
        <source>Every joint through its range, one after the other and together; the wrist turns. For measuring a hand.</source>
        <translation>Jedes Gelenk durch seinen Bereich, nacheinander und gemeinsam; das Handgelenk dreht sich. Zum Vermessen einer Hand.</translation>
    </message>
    <message>
        <source>tap</source>
        <translation>tippen</translation>
    </message>
    <message>
        <source>Fingers tap in turn, the hand spread and held towards the cameras as over a desk; with its back to them (--set facing=back) all nails show.</source>
        <translation>Finger tippen der Reihe nach, die Hand gespreizt und den Kameras entgegen, wie über einem Tisch; mit dem Handrücken zu ihnen (--set facing=back) sind alle Nägel zu sehen.</translation>
    </message>
    <message>
        <source>wave</source>
        <translation>winken</translation>
    </message>
    <message>
        <source>A greeting: the hand swings about the forearm and the fingers follow.</source>
        <translation>Ein Gruß: Die Hand schwingt um den Unterarm, und die Finger folgen.</translation>
    </message>
    <message>
        <source>dd MMM yyyy, HH:mm</source>
        <translation>dd. MMM yyyy, HH:mm</translation>
    </message>
    <message>
        <source>Node {name} uses another marker set than the rig; give both the same marker file.</source>
        <translation>Knoten {name} benutzt einen anderen Markersatz als das Rig; beiden dieselbe Markerdatei geben.</translation>
    </message>
    <message>
        <source>Node {name} sends landmarks of a hand, but no marker of the rig is one. Give the rig the marker set landmarks21, or the node another detector.</source>
        <translation>Knoten {name} sendet Landmarken einer Hand, aber kein Marker des Rigs ist eine. Dem Rig den Markersatz landmarks21 geben oder dem Knoten einen anderen Detektor.</translation>
    </message>
    <message>
        <source>Node {name} sends images of {size} px, but the rig&apos;s intrinsics are for {expected} px; set the node&apos;s camera or calibrate it for this size.</source>
        <translation>Knoten {name} sendet Bilder von {size} px, aber die Intrinsik des Rigs gilt für {expected} px; die Kamera des Knotens einstellen oder sie für diese Größe kalibrieren.</translation>
    </message>
    <message>
        <source>Node {name} sends frames with impossible times; its clock may have been set. If this does not end, restart the node.</source>
        <translation>Knoten {name} sendet Bilder mit unmöglichen Zeiten; vielleicht wurde seine Uhr gestellt. Hört das nicht auf, den Knoten neu starten.</translation>
    </message>
    <message>
        <source>Another node sends to the port of {name}; check the node ids and data ports.</source>
        <translation>Ein anderer Knoten sendet an den Port von {name}; Knoten-IDs und Datenports prüfen.</translation>
    </message>
    <message>
        <source>Node {name} speaks another version of the wire; install the same version here and there.</source>
        <translation>Knoten {name} spricht eine andere Version des Protokolls; hier und dort dieselbe Version installieren.</translation>
    </message>
    <message>
        <source>Datagrams that are not tagged with the key of node {name} are refused at its port: somebody sends in its place.</source>
        <translation>Datagramme ohne den Schlüssel des Knotens {name} werden an seinem Port abgelehnt: Jemand sendet an seiner Stelle.</translation>
    </message>
    <message>
        <source>Datagrams without a tag are refused at the port of node {name}: somebody sends in its place, or the node was made open after it was paired.</source>
        <translation>Datagramme ohne Signatur werden am Port des Knotens {name} abgelehnt: Jemand sendet an seiner Stelle, oder der Knoten wurde nach dem Koppeln geöffnet.</translation>
    </message>
    <message>
        <source>An observation kind failed over datagrams of node {name}. The log has its exception; remove the plug-in that adds it, or report this.</source>
        <translation>Eine Beobachtungsart scheiterte an Datagrammen des Knotens {name}. Das Protokoll enthält ihre Ausnahme; das Plug-in entfernen, das sie hinzufügt, oder dies melden.</translation>
    </message>
    <message>
        <source>Node {name} jumped in its sequence numbers; if this does not end, restart the node.</source>
        <translation>Knoten {name} sprang in seinen Folgenummern; hört das nicht auf, den Knoten neu starten.</translation>
    </message>
    <message>
        <source>The kernel drops datagrams of node {name}: this computer is too busy to read them. Close other programs, or allow a larger buffer with `sudo sysctl -w net.core.rmem_max=8388608`.</source>
        <translation>Der Kernel verwirft Datagramme des Knotens {name}: Dieser Rechner ist zu ausgelastet, um sie zu lesen. Andere Programme schließen oder mit `sudo sysctl -w net.core.rmem_max=8388608` einen größeren Puffer erlauben.</translation>
    </message>
    <message>
        <source>Frames of node {name} on this computer come too late to be used. {busy}</source>
        <translation>Bilder des Knotens {name} auf diesem Rechner kommen zu spät, um genutzt zu werden. {busy}</translation>
    </message>
    <message>
        <source>This computer is too busy: close other programs, or lower the frame rate.</source>
        <translation>Dieser Rechner ist zu ausgelastet: andere Programme schließen oder weniger Bilder pro Sekunde aufnehmen.</translation>
    </message>
    <message>
        <source>Use a cable instead of wireless.</source>
        <translation>Ein Kabel statt Funk benutzen.</translation>
    </message>
    <message>
        <source>The disk of {folder} will be full in less than a minute at the rate of this recording, which then ends. Make room, or stop the recording.</source>
        <translation>Die Platte von {folder} ist beim Tempo dieser Aufnahme in weniger als einer Minute voll; dann endet die Aufnahme. Platz schaffen oder die Aufnahme beenden.</translation>
    </message>
    <message>
        <source>No hand is followed. Take the pose that the pictures show in white, and hold it.</source>
        <translation>Keine Hand wird verfolgt. Die Pose einnehmen, die die Bilder in Weiß zeigen, und halten.</translation>
    </message>
    <message>
        <source>The classic tracker follows the first hand only and takes the markers of the other one for free points. Choose the estimator for two hands at once.</source>
        <translation>Der klassische Tracker verfolgt nur die erste Hand und hält die Marker der anderen für freie Punkte. Für zwei Hände zugleich den Schätzer wählen.</translation>
    </message>
    <message>
        <source>Node {name}: text datagrams arrive, but tracking is not started: press Start.</source>
        <translation>Knoten {name}: Text-Datagramme kommen an, aber die Verfolgung ist nicht gestartet: Start drücken.</translation>
    </message>
    <message>
        <source>Node {name}: no text datagrams come in; send them to its data port.</source>
        <translation>Knoten {name}: Es kommen keine Text-Datagramme an; sie an seinen Datenport senden.</translation>
    </message>
    <message>
        <source>Node {name} at {address} does not know this computer: it was reset or made open, or never paired with it. Pair it: `rhot-node pair` on the node, `rhot pair {name} --rig FILE` here.</source>
        <translation>Knoten {name} unter {address} kennt diesen Rechner nicht: Er wurde zurückgesetzt, geöffnet oder nie mit ihm gekoppelt. Koppeln: `rhot-node pair` auf dem Knoten, `rhot pair {name} --rig FILE` hier.</translation>
    </message>
    <message>
        <source>Node {name} does not answer. {message}</source>
        <translation>Knoten {name} antwortet nicht. {message}</translation>
    </message>
    <message>
        <source>Node {name} does not answer at {address}:{port}. Is it switched on, is rhot-node running there, and on the same network? It is looked for by its id.{unpaired}</source>
        <translation>Knoten {name} antwortet nicht unter {address}:{port}. Ist er eingeschaltet, läuft rhot-node dort, und im selben Netz? Er wird an seiner ID gesucht.{unpaired}</translation>
    </message>
    <message>
        <source>Node {name}: {message}</source>
        <translation>Knoten {name}: {message}</translation>
    </message>
    <message>
        <source>Node {name} sends text datagrams: untrusted, without times, so fast movements are less exact.</source>
        <translation>Knoten {name} sendet Text-Datagramme: nicht vertrauenswürdig und ohne Zeiten, daher sind schnelle Bewegungen ungenauer.</translation>
    </message>
    <message>
        <source>Node {name} is open, and what it says is untrusted: anybody on the network may steer it or speak in its place. To change that, set its &quot;trust&quot; to &quot;paired&quot; and pair it.</source>
        <translation>Knoten {name} ist offen und nicht vertrauenswürdig: Jeder im Netz kann ihn steuern oder sich für ihn ausgeben. Um das zu ändern, sein &quot;trust&quot; auf &quot;paired&quot; setzen und ihn koppeln.</translation>
    </message>
    <message>
        <source>Node {name}: waiting for its clock.</source>
        <translation>Knoten {name}: wartet auf seine Uhr.</translation>
    </message>
    <message>
        <source>The times of {names} against {first} are not known: cameras that are not synchronised may be up to half a frame apart{most}. Calibrate the times with a waving hand.</source>
        <translation>Die Zeiten von {names} gegenüber {first} sind nicht bekannt: Nicht synchronisierte Kameras können bis zu einem halben Bild auseinanderliegen{most}. Die Zeiten mit einer winkenden Hand kalibrieren.</translation>
    </message>
    <message>
        <source>{by} alone does not find a hand by painted markers. Put {names} together with it, or track a bare hand.</source>
        <translation>{by} allein findet keine Hand mit bemalten Markern. {names} mit ihr zusammensetzen oder eine bloße Hand verfolgen.</translation>
    </message>
    <message>
        <source>{by} alone does not find a hand by painted markers. Add a second camera, or track a bare hand.</source>
        <translation>{by} allein findet keine Hand mit bemalten Markern. Eine zweite Kamera hinzufügen oder eine bloße Hand verfolgen.</translation>
    </message>
    <message>
        <source>{by} alone tracks the hand.{guess}</source>
        <translation>{by} allein verfolgt die Hand.{guess}</translation>
    </message>
    <message>
        <source>{by} alone tracks the hand until {names} is put together with it.{guess}</source>
        <translation>{by} allein verfolgt die Hand, bis {names} mit ihr zusammengesetzt ist.{guess}</translation>
    </message>
    <message>
        <source>{by} alone tracks the hand until {names} are put together with it.{guess}</source>
        <translation>{by} allein verfolgt die Hand, bis {names} mit ihr zusammengesetzt sind.{guess}</translation>
    </message>
    <message>
        <source>The disk of {folder} will be full in about a minute at the rate of this recording, which then ends. Make room, or stop the recording.</source>
        <translation>Die Platte von {folder} ist beim Tempo dieser Aufnahme in etwa einer Minute voll; dann endet die Aufnahme. Platz schaffen oder die Aufnahme beenden.</translation>
    </message>
    <message>
        <source>The disk of {folder} will be full in {minutes} minutes at the rate of this recording, which then ends. Make room, or stop the recording.</source>
        <translation>Die Platte von {folder} ist beim Tempo dieser Aufnahme in {minutes} Minuten voll; dann endet die Aufnahme. Platz schaffen oder die Aufnahme beenden.</translation>
    </message>
    <message>
        <source>No camera has seen a {hand} for {seconds:.0f} s. Hold it into the pictures. Each node needs the hand networks (`rhot-node landmarks install`) and &quot;detector&quot;: &quot;landmarks&quot; in its settings.</source>
        <translation>Seit {seconds:.0f} s hat keine Kamera eine Hand gesehen ({hand}). Sie in die Bilder halten. Jeder Knoten braucht die Hand-Netze (`rhot-node landmarks install`) und &quot;detector&quot;: &quot;landmarks&quot; in seinen Einstellungen.</translation>
    </message>
    <message>
        <source>No camera has seen a marker for {seconds:.0f} s. Hold the hand into both pictures; if the markers are visible there, calibrate their colours.</source>
        <translation>Seit {seconds:.0f} s hat keine Kamera einen Marker gesehen. Die Hand in beide Bilder halten; sind die Marker dort zu sehen, ihre Farben kalibrieren.</translation>
    </message>
    <message>
        <source>Node {name} has moved from {before} to {address} and is used there. Save the rig, so that it is looked for there the next time.</source>
        <translation>Knoten {name} ist von {before} nach {address} umgezogen und wird dort benutzt. Das Rig speichern, damit er das nächste Mal dort gesucht wird.</translation>
    </message>
    <message>
        <source> The rig has no key for it: if it waits to be paired, run `rhot-node pair` there and `rhot pair` here.</source>
        <translation> Das Rig hat keinen Schlüssel für ihn: Wartet er auf das Koppeln, dort `rhot-node pair` und hier `rhot pair` ausführen.</translation>
    </message>
    <message>
        <source>it reports a fault; look at its log.</source>
        <translation>er meldet einen Fehler; in sein Protokoll sehen.</translation>
    </message>
    <message>
        <source>Node {name} is ready but does not follow the start; press Stop and Start. If that does not help, restart the node.</source>
        <translation>Knoten {name} ist bereit, folgt aber dem Start nicht; Stopp und Start drücken. Hilft das nicht, den Knoten neu starten.</translation>
    </message>
    <message>
        <source>Node {name} streams for another master; stop that one, or press Stop and Start here to take the node back.</source>
        <translation>Knoten {name} sendet an einen anderen Master; diesen anhalten oder hier Stopp und Start drücken, um den Knoten zurückzuholen.</translation>
    </message>
    <message>
        <source>Node {name}: the system grants a receive buffer of {granted} KiB only, so a busy moment may lose datagrams. Run `sudo sysctl -w net.core.rmem_max={wanted}` and start again.</source>
        <translation>Knoten {name}: Das System gewährt nur {granted} KiB Empfangspuffer, daher können bei Auslastung Datagramme verloren gehen. `sudo sysctl -w net.core.rmem_max={wanted}` ausführen und neu starten.</translation>
    </message>
    <message>
        <source>another size</source>
        <translation>anderer Größe</translation>
    </message>
    <message>
        <source>they are not &quot;x,y;x,y;...&quot; with one pair per marker</source>
        <translation>sie sind nicht &quot;x,y;x,y;...&quot; mit einem Paar je Marker</translation>
    </message>
    <message>
        <source>if an original RHOT node sends text, set text_datagrams for it in the rig</source>
        <translation>sendet ein ursprünglicher RHOT-Knoten Text, für ihn im Rig text_datagrams setzen</translation>
    </message>
    <message>
        <source>Node {name}: {rate:.0f} datagrams/s are not of this protocol and are ignored; {hint}.</source>
        <translation>Knoten {name}: {rate:.0f} Datagramme/s gehören nicht zu diesem Protokoll und werden ignoriert; {hint}.</translation>
    </message>
    <message>
        <source>Node {name}: {percent:.0f} % of the datagrams are lost. {remedy}</source>
        <translation>Knoten {name}: {percent:.0f} % der Datagramme gehen verloren. {remedy}</translation>
    </message>
    <message>
        <source>Use a cable instead of wireless, or a lower frame rate.</source>
        <translation>Ein Kabel statt Funk benutzen oder weniger Bilder pro Sekunde aufnehmen.</translation>
    </message>
    <message>
        <source>Node {name} floods this computer with {rate:.0f} datagrams/s; only the newest are tracked. Lower its frame rate.</source>
        <translation>Knoten {name} überflutet diesen Rechner mit {rate:.0f} Datagrammen/s; nur die neuesten werden verfolgt. Weniger Bilder pro Sekunde aufnehmen.</translation>
    </message>
    <message>
        <source>{count} frames of node {name} were not tracked within two seconds. {busy}</source>
        <translation>{count} Bilder des Knotens {name} wurden in zwei Sekunden nicht verfolgt. {busy}</translation>
    </message>
    <message>
        <source>Node {name}: its clock is known to ±{bound:.1f} ms only, so fast movements blur. {remedy}</source>
        <translation>Knoten {name}: Seine Uhr ist nur auf ±{bound:.1f} ms bekannt, daher verschwimmen schnelle Bewegungen. {remedy}</translation>
    </message>
    <message>
        <source> The distance is a guess, by the hand&apos;s size and an assumed lens ({degrees} degrees).</source>
        <translation> Der Abstand ist geraten, aus der Größe der Hand und einem angenommenen Objektiv ({degrees} Grad).</translation>
    </message>
    <message>
        <source> The distance is a guess, by the hand&apos;s size.</source>
        <translation> Der Abstand ist geraten, aus der Größe der Hand.</translation>
    </message>
    <message>
        <source>{name} is black: is the lens covered?</source>
        <translation>{name} ist schwarz: Ist das Objektiv abgedeckt?</translation>
    </message>
    <message>
        <source>Camera {name} has seen no marker for {seconds:.0f} s: hold the hand into its picture, or calibrate the colours.</source>
        <translation>Kamera {name} hat seit {seconds:.0f} s keinen Marker gesehen: die Hand in ihr Bild halten oder die Farben kalibrieren.</translation>
    </message>
    <message>
        <source>Camera {name} has not seen {names} and others for {seconds:.0f} s: hidden, outside its picture, or the light has changed. Turn the hand, or calibrate the colours.</source>
        <translation>Kamera {name} hat {names} und andere seit {seconds:.0f} s nicht gesehen: verdeckt, außerhalb ihres Bildes, oder das Licht hat sich geändert. Die Hand drehen oder die Farben kalibrieren.</translation>
    </message>
    <message>
        <source>Camera {name} has not seen {names} for {seconds:.0f} s: hidden, outside its picture, or the light has changed. Turn the hand, or calibrate the colours.</source>
        <translation>Kamera {name} hat {names} seit {seconds:.0f} s nicht gesehen: verdeckt, außerhalb ihres Bildes, oder das Licht hat sich geändert. Die Hand drehen oder die Farben kalibrieren.</translation>
    </message>
    <message>
        <source>Node {name} cannot be told to record its video: its control channel does not answer.</source>
        <translation>Knoten {name} lässt sich nicht zur Videoaufnahme bringen: Sein Steuerkanal antwortet nicht.</translation>
    </message>
    <message>
        <source>No video is recorded: {message}</source>
        <translation>Es wird kein Video aufgenommen: {message}</translation>
    </message>
    <message>
        <source>The video of node {name} has ended. {message}</source>
        <translation>Das Video des Knotens {name} ist zu Ende. {message}</translation>
    </message>
    <message>
        <source>Node {name} drops frames of its video, {dropped} so far: its processor or disk is too slow. Detection goes first.</source>
        <translation>Knoten {name} lässt Bilder seines Videos aus, bisher {dropped}: Sein Prozessor oder seine Platte ist zu langsam. Die Erkennung geht vor.</translation>
    </message>
    <message>
        <source>Node {name} cannot search for a bare hand. Does rhot-node have the version of this program there?</source>
        <translation>Knoten {name} kann nicht nach einer bloßen Hand suchen. Hat rhot-node dort die Version dieses Programms?</translation>
    </message>
    <message>
        <source>Node {name} learns the background: keep the hand out of its picture.</source>
        <translation>Knoten {name} lernt den Hintergrund: die Hand aus seinem Bild halten.</translation>
    </message>
    <message>
        <source>Node {name} has learnt neither background nor skin, so no bare hand can be tracked by its contours. Use Calibrate, Background and skin.</source>
        <translation>Knoten {name} hat weder Hintergrund noch Haut gelernt, daher lässt sich keine bloße Hand über ihre Konturen verfolgen. Kalibrieren, Hintergrund und Haut benutzen.</translation>
    </message>
    <message>
        <source>The engine stopped and was started again. The recording continues in {part}; what came before is in {before}.</source>
        <translation>Die Engine ist stehen geblieben und wurde neu gestartet. Die Aufnahme geht in {part} weiter; was davor war, steht in {before}.</translation>
    </message>
    <message>
        <source>The new rig is being prepared; the one before is tracked until then.</source>
        <translation>Das neue Rig wird vorbereitet; bis dahin gilt bei der Verfolgung das bisherige.</translation>
    </message>
    <message>
        <source>The bare hand has shown how long and how thick its fingers are: its file can be adapted to it.</source>
        <translation>Die bloße Hand hat gezeigt, wie lang und wie dick ihre Finger sind: Ihre Datei kann daran angepasst werden.</translation>
    </message>
    <message>
        <source>The landmarks show bones that differ from the rig&apos;s hand by {apart:.0f} mm (rms). With them the joints are more accurate.</source>
        <translation>Die Landmarken zeigen Knochen, die von der Hand des Rigs um {apart:.0f} mm (rms) abweichen. Mit ihnen sind die Gelenke genauer.</translation>
    </message>
    <message>
        <source>this window cannot hear the hand; open the wizard from the main window.</source>
        <translation>dieses Fenster hört die Hand nicht; den Assistenten aus dem Hauptfenster öffnen.</translation>
    </message>
    <message>
        <source>Aligning both trackers …</source>
        <translation>Beide Tracker werden ausgerichtet …</translation>
    </message>
    <message>
        <source>Record a movement of both first.</source>
        <translation>Zuerst eine Bewegung beider aufnehmen.</translation>
    </message>
    <message>
        <source>A Vive tracker, by SteamVR on this machine.</source>
        <translation>Ein Vive-Tracker, über SteamVR auf diesem Rechner.</translation>
    </message>
    <message>
        <source>A Vive tracker, by survive-cli on this machine.</source>
        <translation>Ein Vive-Tracker, über survive-cli auf diesem Rechner.</translation>
    </message>
    <message>
        <source>Program</source>
        <translation>Programm</translation>
    </message>
    <message>
        <source>A program that prints a line for each pose.</source>
        <translation>Ein Programm, das für jede Pose eine Zeile ausgibt.</translation>
    </message>
    <message>
        <source>program and arguments</source>
        <translation>Programm und Argumente</translation>
    </message>
    <message>
        <source>Lines that a program sends to this port.</source>
        <translation>Zeilen, die ein Programm an diesen Port sendet.</translation>
    </message>
    <message>
        <source>A program that serves lines.</source>
        <translation>Ein Programm, das Zeilen bereitstellt.</translation>
    </message>
    <message>
        <source>A tracker on the simulated index fingertip.</source>
        <translation>Ein Tracker an der simulierten Zeigefingerspitze.</translation>
    </message>
    <message>
        <source>Choose the other tracker, switch it on, then connect.</source>
        <translation>Den anderen Tracker auswählen, einschalten und dann verbinden.</translation>
    </message>
    <message>
        <source>poses</source>
        <translation>Posen</translation>
    </message>
    <message>
        <source>{least_hz:.0f} or more a second</source>
        <translation>{least_hz:.0f} oder mehr pro Sekunde</translation>
    </message>
    <message>
        <source>{rate_hz:.0f} poses a second. Go on.</source>
        <translation>{rate_hz:.0f} Posen pro Sekunde. Weiter.</translation>
    </message>
    <message>
        <source>Waiting for poses.</source>
        <translation>Warten auf Posen.</translation>
    </message>
    <message>
        <source>Good, go on.</source>
        <translation>Gut, weiter so.</translation>
    </message>
    <message>
        <source>Move both</source>
        <translation>Beide bewegen</translation>
    </message>
    <message>
        <source>Tie the tracker to the finger. Press Record, then move and turn both, irregularly.</source>
        <translation>Den Tracker am Finger befestigen. Aufnehmen drücken, dann beide unregelmäßig bewegen und drehen.</translation>
    </message>
    <message>
        <source>Moves and turns.</source>
        <translation>Bewegt und dreht sich.</translation>
    </message>
    <message>
        <source>The tracker gives no poses. Go back and connect it.</source>
        <translation>Der Tracker liefert keine Posen. Zurückgehen und ihn verbinden.</translation>
    </message>
    <message>
        <source>The marker {marker} is not seen by two cameras. Hold it before them, or choose another one.</source>
        <translation>Der Marker {marker} wird nicht von zwei Kameras gesehen. Ihn vor sie halten oder einen anderen wählen.</translation>
    </message>
    <message>
        <source>of the tracker about two axes, {degrees:.0f} degrees rms</source>
        <translation>des Trackers um zwei Achsen, {degrees:.0f} Grad Effektivwert</translation>
    </message>
    <message>
        <source>reach</source>
        <translation>Reichweite</translation>
    </message>
    <message>
        <source>of the finger across its longest way, {enough_mm:.0f} mm rms</source>
        <translation>des Fingers über seinen längsten Weg, {enough_mm:.0f} mm Effektivwert</translation>
    </message>
    <message>
        <source>speed</source>
        <translation>Tempo</translation>
    </message>
    <message>
        <source>of the finger, {enough_mm_s:.0f} mm/s rms</source>
        <translation>des Fingers, {enough_mm_s:.0f} mm/s Effektivwert</translation>
    </message>
    <message>
        <source>Keep the marker in view.</source>
        <translation>Den Marker im Blick halten.</translation>
    </message>
    <message>
        <source>Turn the tracker while you move it.</source>
        <translation>Den Tracker beim Bewegen drehen.</translation>
    </message>
    <message>
        <source>Turn it about a second axis, too.</source>
        <translation>Ihn auch um eine zweite Achse drehen.</translation>
    </message>
    <message>
        <source>Move farther: up and down, left and right, near and far.</source>
        <translation>Weiter bewegen: auf und ab, links und rechts, nah und fern.</translation>
    </message>
    <message>
        <source>Move faster.</source>
        <translation>Schneller bewegen.</translation>
    </message>
    <message>
        <source>the only one</source>
        <translation>der einzige</translation>
    </message>
    <message>
        <source>Serial number, name or role. Empty: the only one.</source>
        <translation>Seriennummer, Name oder Rolle. Leer: der einzige.</translation>
    </message>
    <message>
        <source>Connect</source>
        <translation>Verbinden</translation>
    </message>
    <message>
        <source>Source</source>
        <translation>Quelle</translation>
    </message>
    <message>
        <source>Where</source>
        <translation>Wo</translation>
    </message>
    <message>
        <source>{name}: {rate_hz:.0f} poses a second</source>
        <translation>{name}: {rate_hz:.0f} Posen pro Sekunde</translation>
    </message>
    <message>
        <source>What both show is kept until this window closes.</source>
        <translation>Was beide zeigen, bleibt erhalten, bis dieses Fenster schließt.</translation>
    </message>
    <message>
        <source>The marker that the tracker is tied to.</source>
        <translation>Der Marker, an dem der Tracker befestigt ist.</translation>
    </message>
    <message>
        <source>Marker</source>
        <translation>Marker</translation>
    </message>
    <message>
        <source>Move freely</source>
        <translation>Frei bewegen</translation>
    </message>
    <message>
        <source>Press Record, then bend and stretch every finger and turn the hand.</source>
        <translation>Aufnehmen drücken, dann jeden Finger beugen und strecken und die Hand drehen.</translation>
    </message>
    <message>
        <source>Moves every joint: all of them within the minute.</source>
        <translation>Bewegt jedes Gelenk: alle innerhalb einer Minute.</translation>
    </message>
    <message>
        <source>Press Next: the bones were entered.</source>
        <translation>Weiter drücken: Die Knochen wurden eingegeben.</translation>
    </message>
    <message>
        <source>Fitting the hand …</source>
        <translation>Die Hand wird angepasst …</translation>
    </message>
    <message>
        <source>Record the movement first.</source>
        <translation>Zuerst die Bewegung aufnehmen.</translation>
    </message>
    <message>
        <source>Your hand</source>
        <translation>Die Hand</translation>
    </message>
    <message>
        <source>Mend what was entered.</source>
        <translation>Berichtigen, was eingegeben wurde.</translation>
    </message>
    <message>
        <source>Press Next to measure by movement.</source>
        <translation>Weiter drücken, um durch Bewegung zu vermessen.</translation>
    </message>
    <message>
        <source>Or enter bones that you have measured with a ruler, joint to joint.</source>
        <translation>Oder Knochen eingeben, die mit dem Lineal gemessen wurden, von Gelenk zu Gelenk.</translation>
    </message>
    <message>
        <source>Press Next: the bones are as entered.</source>
        <translation>Weiter drücken: Die Knochen sind wie eingegeben.</translation>
    </message>
    <message>
        <source>bent and stretched {sweeps} times; how far shows when the hand is fitted</source>
        <translation>{sweeps}-mal gebeugt und gestreckt; wie weit, zeigt sich beim Anpassen der Hand</translation>
    </message>
    <message>
        <source>in sight</source>
        <translation>im Blick</translation>
    </message>
    <message>
        <source>of {least_s:.0f} s in which the cameras see the markers together</source>
        <translation>von {least_s:.0f} s, in denen die Kameras die Marker gemeinsam sehen</translation>
    </message>
    <message>
        <source>Show the hand to both cameras.</source>
        <translation>Die Hand beiden Kameras zeigen.</translation>
    </message>
    <message>
        <source>Bend and stretch every finger.</source>
        <translation>Jeden Finger beugen und strecken.</translation>
    </message>
    <message>
        <source>Right hand</source>
        <translation>Rechte Hand</translation>
    </message>
    <message>
        <source>Left hand</source>
        <translation>Linke Hand</translation>
    </message>
    <message>
        <source>Which hand wears the markers.</source>
        <translation>Welche Hand die Marker trägt.</translation>
    </message>
    <message>
        <source>Ctrl+Z. What was entered last.</source>
        <translation>Strg+Z. Die letzte Eingabe.</translation>
    </message>
    <message>
        <source>Most people leave this page as it is: a minute of movement shows the lengths, and how well. A ruler helps where too few markers are worn.</source>
        <translation>Die meisten lassen diese Seite, wie sie ist: Eine Minute Bewegung zeigt die Längen und wie gut sie sind. Ein Lineal hilft, wo zu wenige Marker getragen werden.</translation>
    </message>
    <message>
        <source>first bone</source>
        <translation>erster Knochen</translation>
    </message>
    <message>
        <source>second bone</source>
        <translation>zweiter Knochen</translation>
    </message>
    <message>
        <source>last bone, to the tip</source>
        <translation>letzter, bis zur Spitze</translation>
    </message>
    <message>
        <source>{name}: from the middle of one joint to that of the next, finger bent. {usual:.0f} mm in the hand now in use.</source>
        <translation>{name}: von der Mitte eines Gelenks zur Mitte des nächsten, bei gebeugtem Finger. {usual:.0f} mm bei der jetzt benutzten Hand.</translation>
    </message>
    <message>
        <source>From the wrist over the finger&apos;s root to its stretched tip.</source>
        <translation>Vom Handgelenk über die Fingerwurzel zur gestreckten Spitze.</translation>
    </message>
    <message>
        <source>Solid: the markers show it. Translucent: they show it in part. Hatched: they do not; the length is what is usual for a hand of this size.</source>
        <translation>Voll: Die Marker zeigen es. Durchscheinend: Sie zeigen es zum Teil. Schraffiert: Sie zeigen es nicht; die Länge ist die übliche für eine Hand dieser Größe.</translation>
    </message>
    <message>
        <source>Reach: </source>
        <translation>Reichweite: </translation>
    </message>
    <message>
        <source>No picture shows these settings yet, or they cannot be used: go back.</source>
        <translation>Noch zeigt kein Bild diese Einstellungen, oder sie sind nicht brauchbar: zurückgehen.</translation>
    </message>
    <message>
        <source>Whose settings are turned. Both at once keeps equal cameras equal.</source>
        <translation>Wessen Einstellungen gedreht werden. Beide zugleich hält gleiche Kameras gleich.</translation>
    </message>
    <message>
        <source>All cameras</source>
        <translation>Alle Kameras</translation>
    </message>
    <message>
        <source>Balance on grey</source>
        <translation>Grauabgleich</translation>
    </message>
    <message>
        <source>Drag over something grey or white in a picture first, a sheet of paper for instance. Press again until nothing changes.</source>
        <translation>Zuerst in einem Bild über etwas Graues oder Weißes ziehen, etwa ein Blatt Papier. So oft drücken, bis sich nichts mehr ändert.</translation>
    </message>
    <message>
        <source>Ctrl+Z. The last change back.</source>
        <translation>Strg+Z. Die letzte Änderung zurück.</translation>
    </message>
    <message>
        <source>{name} (they differ)</source>
        <translation>{name} (verschieden)</translation>
    </message>
    <message>
        <source>Exposure time</source>
        <translation>Belichtungszeit</translation>
    </message>
    <message>
        <source>How long each row collects light. Short keeps moving markers sharp; a multiple of the mains&apos; half period (10 ms at 50 Hz, 8.33 ms at 60 Hz) keeps lamps from flickering.</source>
        <translation>Wie lange jede Zeile Licht sammelt. Kurz hält bewegte Marker scharf; ein Vielfaches der halben Netzperiode (10 ms bei 50 Hz, 8.33 ms bei 60 Hz) verhindert das Flackern von Lampen.</translation>
    </message>
    <message>
        <source>Gain</source>
        <translation>Verstärkung</translation>
    </message>
    <message>
        <source>Amplifies the signal, and its noise. Raise it only when light and exposure cannot be.</source>
        <translation>Verstärkt das Signal und sein Rauschen. Nur erhöhen, wenn es mit Licht und Belichtung nicht geht.</translation>
    </message>
    <message>
        <source>Brightness</source>
        <translation>Helligkeit</translation>
    </message>
    <message>
        <source>Added to every pixel. 0 leaves it; it brings no light, so change it last.</source>
        <translation>Wird zu jedem Pixel addiert. 0 lässt es; bringt kein Licht, daher zuletzt ändern.</translation>
    </message>
    <message>
        <source>Contrast</source>
        <translation>Kontrast</translation>
    </message>
    <message>
        <source>Spreads the grey levels about the middle; 1 leaves them.</source>
        <translation>Spreizt die Graustufen um die Mitte; 1 lässt sie.</translation>
    </message>
    <message>
        <source>Saturation</source>
        <translation>Sättigung</translation>
    </message>
    <message>
        <source>How strong colours are; 1 leaves them, more sets the markers apart from grey.</source>
        <translation>Wie kräftig Farben sind; 1 lässt sie, mehr hebt die Marker von Grau ab.</translation>
    </message>
    <message>
        <source>Red gain</source>
        <translation>Rotverstärkung</translation>
    </message>
    <message>
        <source>White balance: raise it when white looks green or blue.</source>
        <translation>Weißabgleich: erhöhen, wenn Weiß grün oder blau aussieht.</translation>
    </message>
    <message>
        <source>Blue gain</source>
        <translation>Blauverstärkung</translation>
    </message>
    <message>
        <source>White balance: raise it when white looks yellow or red.</source>
        <translation>Weißabgleich: erhöhen, wenn Weiß gelb oder rot aussieht.</translation>
    </message>
    <message>
        <source>left to the camera</source>
        <translation>der Kamera überlassen</translation>
    </message>
    <message>
        <source>No picture comes from {name}.</source>
        <translation>Von {name} kommt kein Bild.</translation>
    </message>
    <message>
        <source>Look at the Nodes panel.</source>
        <translation>Das Feld Knoten ansehen.</translation>
    </message>
    <message>
        <source>No camera answers.</source>
        <translation>Keine Kamera antwortet.</translation>
    </message>
    <message>
        <source>Look at the Nodes panel: its sentence says what is wrong.</source>
        <translation>Das Feld Knoten ansehen: Seine Meldung sagt, was nicht stimmt.</translation>
    </message>
    <message>
        <source>The pictures are good: press Next.</source>
        <translation>Die Bilder sind gut: Weiter drücken.</translation>
    </message>
    <message>
        <source>Show the hand with its markers, and turn the knobs until the verdict is good.</source>
        <translation>Die Hand mit ihren Markern zeigen und an den Reglern drehen, bis das Urteil gut ist.</translation>
    </message>
    <message>
        <source>{sentence} The settings in force are no better.</source>
        <translation>{sentence} Die geltenden Einstellungen sind nicht besser.</translation>
    </message>
    <message>
        <source>Palm to the cameras</source>
        <translation>Handfläche zu den Kameras</translation>
    </message>
    <message>
        <source>Back to the cameras</source>
        <translation>Handrücken zu den Kameras</translation>
    </message>
    <message>
        <source>A board, no hand</source>
        <translation>Ein Brett, keine Hand</translation>
    </message>
    <message>
        <source>Hold still.</source>
        <translation>Still halten.</translation>
    </message>
    <message>
        <source>Go on.</source>
        <translation>Weiter.</translation>
    </message>
    <message>
        <source>Measuring the recordings …</source>
        <translation>Die Aufnahmen werden vermessen …</translation>
    </message>
    <message>
        <source>Record a step first.</source>
        <translation>Zuerst einen Schritt aufnehmen.</translation>
    </message>
    <message>
        <source>Rest your hand, palm to the cameras, fingers spread; or rest a board. Then press Record.</source>
        <translation>Die Hand ruhen lassen, Handfläche zu den Kameras, Finger gespreizt; oder ein Brett hinstellen. Dann Aufnehmen drücken.</translation>
    </message>
    <message>
        <source>Hold one marker still, read the ruler, type it, press Record. Eight distances, near to far.</source>
        <translation>Einen Marker still halten, am Lineal ablesen, eintippen, Aufnehmen drücken. Acht Abstände, von nah nach fern.</translation>
    </message>
    <message>
        <source>Press Record, then move a rod with two markers slowly through the whole volume, turning it every way.</source>
        <translation>Aufnehmen drücken, dann einen Stab mit zwei Markern langsam durch den ganzen Raum bewegen und in alle Richtungen drehen.</translation>
    </message>
    <message>
        <source>Turn the cameras to this screen, darken the room, press Record: the patch flashes for 20 seconds.</source>
        <translation>Die Kameras auf diesen Bildschirm richten, den Raum abdunkeln, Aufnehmen drücken: Das Feld blinkt 20 Sekunden lang.</translation>
    </message>
    <message>
        <source>Hang the rod from a string. When it is still, press Record.</source>
        <translation>Den Stab an eine Schnur hängen. Wenn er still hängt, Aufnehmen drücken.</translation>
    </message>
    <message>
        <source>Still</source>
        <translation>Ruhe</translation>
    </message>
    <message>
        <source>Ruler</source>
        <translation>Lineal</translation>
    </message>
    <message>
        <source>Rod</source>
        <translation>Stab</translation>
    </message>
    <message>
        <source>Flash</source>
        <translation>Blinken</translation>
    </message>
    <message>
        <source>Plumb line</source>
        <translation>Lot</translation>
    </message>
    <message>
        <source>{rows} distances. Type the next one and press Record, or go on.</source>
        <translation>{rows} Abstände. Den nächsten eintippen und Aufnehmen drücken, oder weiter.</translation>
    </message>
    <message>
        <source>Keep</source>
        <translation>Behalten</translation>
    </message>
    <message>
        <source>Write the certificate</source>
        <translation>Zertifikat schreiben</translation>
    </message>
    <message>
        <source>It is written.</source>
        <translation>Es ist geschrieben.</translation>
    </message>
    <message>
        <source>It is deleted.</source>
        <translation>Es ist gelöscht.</translation>
    </message>
    <message>
        <source>Write the certificate, or go back and record a step again.</source>
        <translation>Das Zertifikat schreiben oder zurückgehen und einen Schritt noch einmal aufnehmen.</translation>
    </message>
    <message>
        <source>A mirrored rig tracks smoothly and is wrong; this tells.</source>
        <translation>Ein spiegelverkehrtes Rig verfolgt flüssig und falsch; dies zeigt es.</translation>
    </message>
    <message>
        <source>The marker that is held along the ruler.</source>
        <translation>Der Marker, der am Lineal entlang gehalten wird.</translation>
    </message>
    <message>
        <source>From the line between both lenses straight ahead, by a ruler.</source>
        <translation>Von der Linie zwischen beiden Objektiven geradeaus, mit dem Lineal.</translation>
    </message>
    <message>
        <source>Distance</source>
        <translation>Abstand</translation>
    </message>
    <message>
        <source>No distance yet.</source>
        <translation>Noch kein Abstand.</translation>
    </message>
    <message>
        <source>From the centre of one marker to the centre of the other, by a ruler.</source>
        <translation>Von der Mitte des einen Markers zur Mitte des anderen, mit dem Lineal.</translation>
    </message>
    <message>
        <source>The end that is above when the rod hangs.</source>
        <translation>Das Ende, das oben ist, wenn der Stab hängt.</translation>
    </message>
    <message>
        <source>The other end.</source>
        <translation>Das andere Ende.</translation>
    </message>
    <message>
        <source>Upper marker</source>
        <translation>Oberer Marker</translation>
    </message>
    <message>
        <source>Lower marker</source>
        <translation>Unterer Marker</translation>
    </message>
    <message>
        <source>The colour of the patch: one that nothing else in the pictures has.</source>
        <translation>Die Farbe des Feldes: eine, die sonst nichts in den Bildern hat.</translation>
    </message>
    <message>
        <source>Colour of</source>
        <translation>Farbe von</translation>
    </message>
    <message>
        <source>flashing patch</source>
        <translation>blinkendes Feld</translation>
    </message>
    <message>
        <source>Delete it again</source>
        <translation>Wieder löschen</translation>
    </message>
    <message>
        <source>Removes the folder that was written.</source>
        <translation>Entfernt den geschriebenen Ordner.</translation>
    </message>
    <message>
        <source>Pick the markers&apos; colours first.</source>
        <translation>Zuerst die Farben der Marker aufnehmen.</translation>
    </message>
    <message>
        <source>Hue, either way</source>
        <translation>Farbton, zu beiden Seiten</translation>
    </message>
    <message>
        <source>How far a pixel&apos;s hue may be from the marker&apos;s. Wider bears more shade and other lamps; narrower takes less of what has a similar colour.</source>
        <translation>Wie weit der Farbton eines Pixels von dem des Markers abweichen darf. Weiter verträgt mehr Schatten und andere Lampen; enger nimmt weniger von ähnlichen Farben.</translation>
    </message>
    <message>
        <source>Least colour</source>
        <translation>Kleinste Buntheit</translation>
    </message>
    <message>
        <source>How far from grey a pixel must be, in grey levels of chroma. Less bears deeper shade; more leaves out pale things.</source>
        <translation>Wie weit ein Pixel von Grau entfernt sein muss, in Graustufen der Buntheit. Weniger verträgt tieferen Schatten; mehr lässt blasse Dinge aus.</translation>
    </message>
    <message>
        <source>Darkest</source>
        <translation>Dunkelstes</translation>
    </message>
    <message>
        <source>Pixels darker than this are noise.</source>
        <translation>Dunklere Pixel sind Rauschen.</translation>
    </message>
    <message>
        <source>Brightest</source>
        <translation>Hellstes</translation>
    </message>
    <message>
        <source>Pixels brighter than this are burnt highlights.</source>
        <translation>Hellere Pixel sind ausgebrannte Glanzlichter.</translation>
    </message>
    <message>
        <source>Learning the colours …</source>
        <translation>Die Farben werden gelernt …</translation>
    </message>
    <message>
        <source>Check the mask</source>
        <translation>Maske prüfen</translation>
    </message>
    <message>
        <source>Go back and pick a colour.</source>
        <translation>Zurückgehen und eine Farbe aufnehmen.</translation>
    </message>
    <message>
        <source>{marker} is found by {finding} of {count} cameras.</source>
        <translation>{marker} wird von {finding} von {count} Kameras gefunden.</translation>
    </message>
    <message>
        <source>Since the colours were picked: {sentence}</source>
        <translation>Seit die Farben aufgenommen wurden: {sentence}</translation>
    </message>
    <message>
        <source>The mask must fit the markers.</source>
        <translation>Die Maske muss auf die Marker passen.</translation>
    </message>
    <message>
        <source>As learnt</source>
        <translation>Wie gelernt</translation>
    </message>
    <message>
        <source>The chosen marker&apos;s bounds as they were learnt from the samples.</source>
        <translation>Die Grenzen des gewählten Markers, wie sie aus den Proben gelernt wurden.</translation>
    </message>
    <message>
        <source>{text}, by hand</source>
        <translation>{text}, von Hand</translation>
    </message>
    <message>
        <source>doubtful</source>
        <translation>zweifelhaft</translation>
    </message>
    <message>
        <source>not found</source>
        <translation>nicht gefunden</translation>
    </message>
    <message>
        <source>Mask of all markers</source>
        <translation>Maske aller Marker</translation>
    </message>
    <message>
        <source>Mask of the chosen marker</source>
        <translation>Maske des gewählten Markers</translation>
    </message>
    <message>
        <source>Picture without mask</source>
        <translation>Bild ohne Maske</translation>
    </message>
    <message>
        <source>The mask is what the detector really takes for each marker, pixel by pixel, in this light.</source>
        <translation>Die Maske ist, was der Detektor in diesem Licht wirklich für jeden Marker hält, Pixel für Pixel.</translation>
    </message>
    <message>
        <source>Pick the colours</source>
        <translation>Farben aufnehmen</translation>
    </message>
    <message>
        <source>as skin</source>
        <translation>als Haut</translation>
    </message>
    <message>
        <source>as {other}</source>
        <translation>als {other}</translation>
    </message>
    <message>
        <source>was {other}&apos;s</source>
        <translation>war {other}</translation>
    </message>
    <message>
        <source>Click the right paint; Ctrl+Z takes the last click back.</source>
        <translation>Die richtige Farbe anklicken; Strg+Z nimmt den letzten Klick zurück.</translation>
    </message>
    <message>
        <source>{name} has the colour of skin: {shown}.</source>
        <translation>{name} hat die Farbe von Haut: {shown}.</translation>
    </message>
    <message>
        <source>{first} and {second} have one colour: their hues are {apart:.0f}° apart.</source>
        <translation>{first} und {second} haben eine Farbe: Ihre Farbtöne liegen {apart:.0f}° auseinander.</translation>
    </message>
    <message>
        <source>If the hand does not wear them so, click these again.</source>
        <translation>Wenn die Hand sie nicht so trägt, diese noch einmal anklicken.</translation>
    </message>
    <message>
        <source>look at {names} again.</source>
        <translation>noch einmal ansehen: {names}.</translation>
    </message>
    <message>
        <source>picked</source>
        <translation>aufgenommen</translation>
    </message>
    <message>
        <source>{picked} of {count} markers</source>
        <translation>{picked} von {count} Markern</translation>
    </message>
    <message>
        <source>seen moving</source>
        <translation>bewegt gesehen</translation>
    </message>
    <message>
        <source>places and angles at which the markers were seen so far</source>
        <translation>Orte und Winkel, an denen die Marker bisher gesehen wurden</translation>
    </message>
    <message>
        <source>Click {paint} in the held picture.</source>
        <translation>Im angehaltenen Bild anklicken: {paint}.</translation>
    </message>
    <message>
        <source>Click {paint}, or drag over it.</source>
        <translation>Anklicken oder darüberziehen: {paint}.</translation>
    </message>
    <message>
        <source>Choose {marker} and click its paint.</source>
        <translation>{marker} auswählen und seine Farbe anklicken.</translation>
    </message>
    <message>
        <source>Move and turn the hand slowly, near and far.</source>
        <translation>Die Hand langsam bewegen und drehen, nah und fern.</translation>
    </message>
    <message>
        <source>Enough: press Next.</source>
        <translation>Genug: Weiter drücken.</translation>
    </message>
    <message>
        <source>bare skin</source>
        <translation>bloße Haut</translation>
    </message>
    <message>
        <source>the paint of {chosen}</source>
        <translation>die Farbe von {chosen}</translation>
    </message>
    <message>
        <source>{marker} cannot stay so: choose its line and click its paint, or press Ctrl+Z.</source>
        <translation>{marker} kann nicht so bleiben: seine Zeile auswählen und seine Farbe anklicken oder Strg+Z drücken.</translation>
    </message>
    <message>
        <source>Pick bare skin too: then it is said whether a marker looks like it.</source>
        <translation>Auch bloße Haut aufnehmen: Dann wird gesagt, ob ein Marker ihr gleicht.</translation>
    </message>
    <message>
        <source>By the rig&apos;s colours: {figure}</source>
        <translation>Nach den Farben des Rigs: {figure}</translation>
    </message>
    <message>
        <source>Space holds the pictures, if your hands are full.</source>
        <translation>Die Leertaste hält die Bilder an, wenn die Hände voll sind.</translation>
    </message>
    <message>
        <source>{camera} has not seen {name}: {why}</source>
        <translation>{camera} hat {name} nicht gesehen: {why}</translation>
    </message>
    <message>
        <source>Still to be seen in other places: {names}.</source>
        <translation>Noch an anderen Orten zu sehen: {names}.</translation>
    </message>
    <message>
        <source>pictures</source>
        <translation>Bilder</translation>
    </message>
    <message>
        <source>Choose what to click next. The patches are the rig&apos;s colour and the one picked. A tick: enough places and angles were seen; a cross: the colour is another marker&apos;s or the skin&apos;s. Ctrl+Z takes the last click back; clicking a marker anew replaces what was gathered for it.</source>
        <translation>Auswählen, was als Nächstes angeklickt wird. Die Felder sind die Farbe des Rigs und die aufgenommene. Ein Haken: genügend Orte und Winkel wurden gesehen; ein Kreuz: Die Farbe ist die eines anderen Markers oder der Haut. Strg+Z nimmt den letzten Klick zurück; ein neuer Klick auf einen Marker ersetzt, was für ihn gesammelt war.</translation>
    </message>
    <message>
        <source>Hold the pictures</source>
        <translation>Bilder anhalten</translation>
    </message>
    <message>
        <source>Space. Then click at leisure; Space again lets them go on.</source>
        <translation>Leertaste. Dann in Ruhe klicken; noch einmal lässt sie weiterlaufen.</translation>
    </message>
    <message>
        <source>Ctrl+Z. The last click back.</source>
        <translation>Strg+Z. Den letzten Klick zurück.</translation>
    </message>
    <message>
        <source>Let the pictures go on</source>
        <translation>Bilder weiterlaufen lassen</translation>
    </message>
    <message>
        <source>not picked</source>
        <translation>fehlt noch</translation>
    </message>
    <message>
        <source>Read what may be mistaken for a marker, then go on.</source>
        <translation>Lesen, was für einen Marker gehalten werden kann, dann weiter.</translation>
    </message>
    <message>
        <source>Trying the new bounds …</source>
        <translation>Die neuen Grenzen werden ausprobiert …</translation>
    </message>
    <message>
        <source>Tell them apart</source>
        <translation>Unterscheiden</translation>
    </message>
    <message>
        <source>No two colours overlap.</source>
        <translation>Keine zwei Farben überschneiden sich.</translation>
    </message>
    <message>
        <source>Which colour is taken for which</source>
        <translation>Welche Farbe für welche gehalten wird</translation>
    </message>
    <message>
        <source>The table: how much of each column&apos;s colour is taken for the marker of the row, in %, over all lamps that may come; of a marker&apos;s own colour by the lamp where that is least.</source>
        <translation>Die Tabelle: wie viel von der Farbe jeder Spalte für den Marker der Zeile gehalten wird, in %, über alle Lampen, die kommen können; von der eigenen Farbe eines Markers bei der ungünstigsten Lampe.</translation>
    </message>
    <message>
        <source>The chart: the blue line shows which hues the room has, and how much of each. Where it rises inside a marker&apos;s band, the room has things of that marker&apos;s colour.</source>
        <translation>Das Diagramm: Die blaue Linie zeigt, welche Farbtöne der Raum hat und wie viel von jedem. Wo sie im Band eines Markers ansteigt, hat der Raum Dinge von dessen Farbe.</translation>
    </message>
    <message>
        <source>this window cannot hear the markers; open the wizard from the main window.</source>
        <translation>dieses Fenster hört die Marker nicht; den Assistenten aus dem Hauptfenster öffnen.</translation>
    </message>
    <message>
        <source>Fitting the law …</source>
        <translation>Das Gesetz wird angepasst …</translation>
    </message>
    <message>
        <source>The law</source>
        <translation>Das Gesetz</translation>
    </message>
    <message>
        <source>Go back and measure at least {least_rows} distances.</source>
        <translation>Zurückgehen und mindestens {least_rows} Abstände messen.</translation>
    </message>
    <message>
        <source>The points should lie on the line, inside the band.</source>
        <translation>Die Punkte sollen auf der Linie liegen, innerhalb des Bandes.</translation>
    </message>
    <message>
        <source>Measure some distances first.</source>
        <translation>Zuerst einige Abstände messen.</translation>
    </message>
    <message>
        <source>Measure</source>
        <translation>Messen</translation>
    </message>
    <message>
        <source>The marker {name} is not seen by both cameras. Start tracking, and hold it into both pictures.</source>
        <translation>Der Marker {name} wird nicht von beiden Kameras gesehen. Die Verfolgung starten und ihn in beide Bilder halten.</translation>
    </message>
    <message>
        <source>The marker moves ({std:.1f} px). Lay it down or rest the hand, then press Space again.</source>
        <translation>Der Marker bewegt sich ({std:.1f} px). Ihn hinlegen oder die Hand auflegen, dann noch einmal die Leertaste drücken.</translation>
    </message>
    <message>
        <source>This cannot be measured: {reason}.</source>
        <translation>Das lässt sich nicht messen: {reason}.</translation>
    </message>
    <message>
        <source>distances</source>
        <translation>Abstände</translation>
    </message>
    <message>
        <source>{rows} of {enough} or more</source>
        <translation>{rows} von {enough} oder mehr</translation>
    </message>
    <message>
        <source>spread</source>
        <comment>of distances</comment>
        <translation>Spanne</translation>
    </message>
    <message>
        <source>from near to far: the farthest three times the nearest</source>
        <translation>von nah bis fern: der fernste dreimal so weit wie der nächste</translation>
    </message>
    <message>
        <source>Hold the marker straight before the cameras, enter its distance, press Space.</source>
        <translation>Den Marker gerade vor die Kameras halten, seinen Abstand eingeben, die Leertaste drücken.</translation>
    </message>
    <message>
        <source>Now at another distance.</source>
        <translation>Jetzt in einem anderen Abstand.</translation>
    </message>
    <message>
        <source>Enough. Go on, or measure more.</source>
        <translation>Genug. Weiter oder mehr messen.</translation>
    </message>
    <message>
        <source>Now much nearer, or much farther away.</source>
        <translation>Jetzt viel näher oder viel weiter weg.</translation>
    </message>
    <message>
        <source>cm</source>
        <translation>cm</translation>
    </message>
    <message>
        <source>px</source>
        <translation>px</translation>
    </message>
    <message>
        <source>The marker that is held at the distance.</source>
        <translation>Der Marker, der in den Abstand gehalten wird.</translation>
    </message>
    <message>
        <source>From the middle between both lenses straight to the marker, by a tape measure.</source>
        <translation>Von der Mitte zwischen beiden Objektiven gerade zum Marker, mit dem Maßband.</translation>
    </message>
    <message>
        <source>Take this distance</source>
        <translation>Diesen Abstand nehmen</translation>
    </message>
    <message>
        <source>Space. Takes the disparity that both cameras have seen in the last second.</source>
        <translation>Leertaste. Nimmt die Disparität, die beide Kameras in der letzten Sekunde gesehen haben.</translation>
    </message>
    <message>
        <source>Disparity</source>
        <translation>Disparität</translation>
    </message>
    <message>
        <source>Distance, mean disparity and its spread within the second.</source>
        <translation>Abstand, mittlere Disparität und ihre Streuung innerhalb der Sekunde.</translation>
    </message>
    <message>
        <source>Remove the chosen row</source>
        <translation>Gewählte Zeile entfernen</translation>
    </message>
    <message>
        <source>Shows one marker at: choose the distance that you enter here.</source>
        <translation>„Zeigt einen Marker bei“: den hier eingegebenen Abstand auswählen.</translation>
    </message>
    <message>
        <source>{mean:.2f} ± {std:.2f} px</source>
        <translation>{mean:.2f} ± {std:.2f} px</translation>
    </message>
    <message>
        <source>not seen by both cameras</source>
        <translation>nicht in beiden Bildern</translation>
    </message>
    <message>
        <source>Learn the empty scene and your hand first.</source>
        <translation>Zuerst die leere Szene und die Hand lernen.</translation>
    </message>
    <message>
        <source>Learn the empty scene</source>
        <translation>Leere Szene lernen</translation>
    </message>
    <message>
        <source>Learn my skin</source>
        <translation>Meine Haut lernen</translation>
    </message>
    <message>
        <source>Tried out at once by every node, and kept by none before the last step.</source>
        <translation>Von jedem Knoten sofort ausprobiert und von keinem vor dem letzten Schritt behalten.</translation>
    </message>
    <message>
        <source>a node learns neither background nor skin. Does rhot-node have the version of this program there?</source>
        <translation>ein Knoten lernt weder Hintergrund noch Haut. Hat rhot-node dort die Version dieses Programms?</translation>
    </message>
    <message>
        <source>{camera}: something moved in {moving:.1%} of the picture.</source>
        <translation>{camera}: Etwas bewegte sich in {moving:.1%} des Bildes.</translation>
    </message>
    <message>
        <source>What moves is no background.</source>
        <translation>Was sich bewegt, ist kein Hintergrund.</translation>
    </message>
    <message>
        <source>Keep out of the picture and learn it again.</source>
        <translation>Aus dem Bild bleiben und ihn noch einmal lernen.</translation>
    </message>
    <message>
        <source>{camera}: something in {skin:.1%} of the picture has the colours of skin.</source>
        <translation>{camera}: Etwas in {skin:.1%} des Bildes hat die Farben von Haut.</translation>
    </message>
    <message>
        <source>A hand that is learnt as background is not found there.</source>
        <translation>Eine Hand, die als Hintergrund gelernt ist, wird dort nicht gefunden.</translation>
    </message>
    <message>
        <source>If it is a hand or a face, take it away and learn again; if it is wood or cloth, go on.</source>
        <translation>Ist es eine Hand oder ein Gesicht, wegnehmen und noch einmal lernen; ist es Holz oder Stoff, weiter.</translation>
    </message>
    <message>
        <source>Empty scene</source>
        <translation>Leere Szene</translation>
    </message>
    <message>
        <source>{names}: the background was not learnt in time. Look at the Nodes panel, then learn it again.</source>
        <translation>{names}: Der Hintergrund wurde nicht rechtzeitig gelernt. Das Feld Knoten ansehen, dann noch einmal lernen.</translation>
    </message>
    <message>
        <source>the scene is learnt.</source>
        <translation>die Szene ist gelernt.</translation>
    </message>
    <message>
        <source>Keep out of the pictures.</source>
        <translation>Aus den Bildern bleiben.</translation>
    </message>
    <message>
        <source>Learnt. Go on, or learn it again after anything in the pictures has changed.</source>
        <translation>Gelernt. Weiter, oder noch einmal lernen, wenn sich in den Bildern etwas geändert hat.</translation>
    </message>
    <message>
        <source>Is the scene empty? Read what was seen, and learn it again.</source>
        <translation>Ist die Szene leer? Lesen, was gesehen wurde, und noch einmal lernen.</translation>
    </message>
    <message>
        <source>Take the hand out of both pictures and leave everything as it will be. Then press Learn.</source>
        <translation>Die Hand aus beiden Bildern nehmen und alles so lassen, wie es sein wird. Dann Lernen drücken.</translation>
    </message>
    <message>
        <source>empty scene</source>
        <translation>leere Szene</translation>
    </message>
    <message>
        <source>{seconds:g} s of every camera</source>
        <translation>{seconds:g} s von jeder Kamera</translation>
    </message>
    <message>
        <source>No skin was found in the picture of {names}, so the colours of any skin are used there. Hold the hand into both pictures and learn it again.</source>
        <translation>Im Bild von {names} wurde keine Haut gefunden, daher gelten dort die Farben irgendeiner Haut. Die Hand in beide Bilder halten und noch einmal lernen.</translation>
    </message>
    <message>
        <source>{name}: {covered:.1%} of the picture is the hand</source>
        <translation>{name}: {covered:.1%} des Bildes ist die Hand</translation>
    </message>
    <message>
        <source>One moment.</source>
        <translation>Einen Moment.</translation>
    </message>
    <message>
        <source>Hold your bare hand into both pictures, fingers spread, and press Learn.</source>
        <translation>Die bloße Hand in beide Bilder halten, Finger gespreizt, und Lernen drücken.</translation>
    </message>
    <message>
        <source>The hand and little else should be tinted: then press Next.</source>
        <translation>Die Hand und wenig anderes soll getönt sein: dann Weiter drücken.</translation>
    </message>
    <message>
        <source>Read what is wrong, then learn it again.</source>
        <translation>Lesen, was nicht stimmt, dann noch einmal lernen.</translation>
    </message>
    <message>
        <source>a node gave a foreground that cannot be read; restart it.</source>
        <translation>ein Knoten lieferte einen Vordergrund, der nicht lesbar ist; ihn neu starten.</translation>
    </message>
    <message>
        <source>{camera}: the hand covers {told_apart} % of the picture, less than {least:g} %.</source>
        <translation>{camera}: Die Hand bedeckt {told_apart} % des Bildes, weniger als {least:g} %.</translation>
    </message>
    <message>
        <source>It was in the picture while the empty scene was learnt, or is not there now.</source>
        <translation>Sie war im Bild, während die leere Szene gelernt wurde, oder ist jetzt nicht da.</translation>
    </message>
    <message>
        <source>Hold it into the picture; if it is there, go back and learn the empty scene without it.</source>
        <translation>Sie ins Bild halten; ist sie da, zurückgehen und die leere Szene ohne sie lernen.</translation>
    </message>
    <message>
        <source>{camera}: {told_apart} % of the picture differs from the empty scene, more than {most:g} %.</source>
        <translation>{camera}: {told_apart} % des Bildes weicht von der leeren Szene ab, mehr als {most:g} %.</translation>
    </message>
    <message>
        <source>Light, exposure or the camera have changed since.</source>
        <translation>Licht, Belichtung oder die Kamera haben sich seither geändert.</translation>
    </message>
    <message>
        <source>Go back and learn the empty scene again.</source>
        <translation>Zurückgehen und die leere Szene noch einmal lernen.</translation>
    </message>
    <message>
        <source>{camera}: {whole:.0%} of what is tinted is not the hand.</source>
        <translation>{camera}: {whole:.0%} des Getönten ist nicht die Hand.</translation>
    </message>
    <message>
        <source>Shadows, a second hand, a face or moving things.</source>
        <translation>Schatten, eine zweite Hand, ein Gesicht oder bewegte Dinge.</translation>
    </message>
    <message>
        <source>Take them away, or have more even light.</source>
        <translation>Sie wegnehmen oder für gleichmäßigeres Licht sorgen.</translation>
    </message>
    <message>
        <source>Each node keeps what it had, and Restore the old one brings it back here, until this window closes.</source>
        <translation>Jeder Knoten behält, was er hatte, und „Die alte wiederherstellen“ holt es hier zurück, bis dieses Fenster schließt.</translation>
    </message>
    <message>
        <source>{name} still has what was learnt now: {exc}</source>
        <translation>{name} hat noch, was jetzt gelernt wurde: {exc}</translation>
    </message>
    <message>
        <source>{name}: background</source>
        <translation>{name}: Hintergrund</translation>
    </message>
    <message>
        <source>learnt now</source>
        <translation>jetzt gelernt</translation>
    </message>
    <message>
        <source>{name}: skin</source>
        <translation>{name}: Haut</translation>
    </message>
    <message>
        <source>Calibrate, Tracker chooses the bare hand.</source>
        <translation>Kalibrieren, Tracker wählt die bloße Hand aus.</translation>
    </message>
    <message>
        <source>learnt earlier</source>
        <translation>früher gelernt</translation>
    </message>
    <message>
        <source>Next waits for this size: every length that is measured later comes from it.</source>
        <translation>Weiter wartet auf diese Größe: Jede Länge, die später gemessen wird, kommt aus ihr.</translation>
    </message>
    <message>
        <source>Not seen: {missing}.</source>
        <translation>Nicht gesehen: {missing}.</translation>
    </message>
    <message>
        <source>Go back: the board is another one than the form says.</source>
        <translation>Zurückgehen: Das Brett ist ein anderes, als das Formular sagt.</translation>
    </message>
    <message>
        <source>Your board</source>
        <translation>Das Brett</translation>
    </message>
    <message>
        <source>Say which board you hold.</source>
        <translation>Sagen, welches Brett es ist.</translation>
    </message>
    <message>
        <source>Count the corners again.</source>
        <translation>Die Ecken noch einmal zählen.</translation>
    </message>
    <message>
        <source>Measure the {parts} and type their size.</source>
        <translation>Messen und die Größe eintippen: {parts}.</translation>
    </message>
    <message>
        <source>Seen: this is the board. Press Next.</source>
        <translation>Gesehen: Das ist das Brett. Weiter drücken.</translation>
    </message>
    <message>
        <source>Show the board to check it.</source>
        <translation>Das Brett zeigen, um es zu prüfen.</translation>
    </message>
    <message>
        <source>Seen by {names}: this is the board.</source>
        <translation>Gesehen von {names}: Das ist das Brett.</translation>
    </message>
    <message>
        <source>This board looks the same turned by 180°: hold it the same way up all the time, or use one with an even and an odd number of corners, or with an odd number of rows of circles.</source>
        <translation>Dieses Brett sieht um 180° gedreht gleich aus: es die ganze Zeit gleich herum halten oder eines mit einer geraden und einer ungeraden Eckenzahl oder mit ungerader Zahl von Kreisreihen nehmen.</translation>
    </message>
    <message>
        <source>Measure ten with a ruler and divide by ten: printers scale. The scale of everything that is measured later comes from this number.</source>
        <translation>Zehn mit dem Lineal messen und durch zehn teilen: Drucker skalieren. Der Maßstab von allem, was später gemessen wird, kommt aus dieser Zahl.</translation>
    </message>
    <message>
        <source>Chessboard</source>
        <translation>Schachbrett</translation>
    </message>
    <message>
        <source>Inner corners</source>
        <translation>Innere Ecken</translation>
    </message>
    <message>
        <source>Count the points where four squares meet: a board of 10 × 7 squares has 9 × 6.</source>
        <translation>Die Punkte zählen, an denen vier Felder zusammenstoßen: Ein Brett mit 10 × 7 Feldern hat 9 × 6.</translation>
    </message>
    <message>
        <source>Square, mm</source>
        <translation>Feld, mm</translation>
    </message>
    <message>
        <source>The side of one square as it came out of the printer.</source>
        <translation>Die Seite eines Feldes, wie es aus dem Drucker kam.</translation>
    </message>
    <message>
        <source>ChArUco board</source>
        <translation>ChArUco-Brett</translation>
    </message>
    <message>
        <source>Squares</source>
        <translation>Felder</translation>
    </message>
    <message>
        <source>Count the squares.</source>
        <translation>Die Felder zählen.</translation>
    </message>
    <message>
        <source>Tags</source>
        <translation>Tags</translation>
    </message>
    <message>
        <source>Count the tags: tagCols, tagRows of Kalibr&apos;s file.</source>
        <translation>Die Tags zählen: tagCols, tagRows der Datei von Kalibr.</translation>
    </message>
    <message>
        <source>Tag, mm</source>
        <translation>Tag, mm</translation>
    </message>
    <message>
        <source>The side of a tag&apos;s black square, tagSize in Kalibr&apos;s file (which has metres).</source>
        <translation>Die Seite des schwarzen Quadrats eines Tags, tagSize in der Datei von Kalibr (die Meter hat).</translation>
    </message>
    <message>
        <source>Circles, asymmetric</source>
        <translation>Kreise, asymmetrisch</translation>
    </message>
    <message>
        <source>Circles</source>
        <translation>Kreise</translation>
    </message>
    <message>
        <source>Count the circles in one row, and then the rows: 4 × 11 is usual.</source>
        <translation>Die Kreise einer Reihe zählen, dann die Reihen: 4 × 11 ist üblich.</translation>
    </message>
    <message>
        <source>Spacing, mm</source>
        <translation>Abstand, mm</translation>
    </message>
    <message>
        <source>From one row of circles to the next, which is half as far as from one circle to the next in its row.</source>
        <translation>Von einer Kreisreihe zur nächsten; das ist halb so weit wie von einem Kreis zum nächsten in seiner Reihe.</translation>
    </message>
    <message>
        <source>The gap between two tags as a part of their side, tagSpacing in Kalibr&apos;s file.</source>
        <translation>Die Lücke zwischen zwei Tags als Teil ihrer Seite, tagSpacing in der Datei von Kalibr.</translation>
    </message>
    <message>
        <source>printed with OpenCV before 4.6</source>
        <translation>gedruckt mit OpenCV vor 4.6</translation>
    </message>
    <message>
        <source>Older programs began ChArUco boards with an even number of rows with a white square.</source>
        <translation>Ältere Programme begannen ChArUco-Bretter mit gerader Zeilenzahl mit einem weißen Feld.</translation>
    </message>
    <message>
        <source>Board</source>
        <translation>Brett</translation>
    </message>
    <message>
        <source>Gap, of a tag</source>
        <translation>Lücke, eines Tags</translation>
    </message>
    <message>
        <source>Marker, mm</source>
        <translation>Marker, mm</translation>
    </message>
    <message>
        <source>Family</source>
        <translation>Familie</translation>
    </message>
    <message>
        <source>Print this board</source>
        <translation>Dieses Brett drucken</translation>
    </message>
    <message>
        <source>Writes it as a PDF of the usual size with a ruler, and opens that to be printed.</source>
        <translation>Schreibt es als PDF der üblichen Größe mit einem Lineal und öffnet es zum Drucken.</translation>
    </message>
    <message>
        <source>Shows a board: {board} inner corners, squares of {square_mm:g} mm.</source>
        <translation>„Zeigt ein Brett“: {board} innere Ecken, Felder von {square_mm:g} mm.</translation>
    </message>
    <message>
        <source>measure it</source>
        <translation>messen</translation>
    </message>
    <message>
        <source>last time {last:g}</source>
        <translation>letztes Mal {last:g}</translation>
    </message>
    <message>
        <source>three quarters of a square</source>
        <translation>drei Viertel eines Feldes</translation>
    </message>
    <message>
        <source>{counted} across</source>
        <translation>{counted} quer</translation>
    </message>
    <message>
        <source>Rows of circles</source>
        <translation>Kreisreihen</translation>
    </message>
    <message>
        <source>{counted} down</source>
        <translation>{counted} hoch</translation>
    </message>
    <message>
        <source>{parent}: cannot be made ({strerror}), so there is no board to print.</source>
        <translation>{parent}: lässt sich nicht anlegen ({strerror}), daher gibt es kein Brett zu drucken.</translation>
    </message>
    <message>
        <source>{told} Print it at 100 % and glue it flat. {note}</source>
        <translation>{told} Mit 100 % drucken und eben aufkleben. {note}</translation>
    </message>
    <message>
        <source>Written to {path} and opened.</source>
        <translation>In {path} geschrieben und geöffnet.</translation>
    </message>
    <message>
        <source>Written to {path}; this desktop opens no PDF.</source>
        <translation>In {path} geschrieben; dieser Desktop öffnet keine PDF.</translation>
    </message>
    <message>
        <source>Go back: something was not recorded yet.</source>
        <translation>Zurückgehen: Etwas wurde noch nicht aufgenommen.</translation>
    </message>
    <message>
        <source>taken</source>
        <translation>Aufnahmen</translation>
    </message>
    <message>
        <source>{count} of {wanted}</source>
        <translation>{count} von {wanted}</translation>
    </message>
    <message>
        <source>{meaning}
Untick it to leave it to the camera.</source>
        <translation>{meaning}
Haken entfernen, um es der Kamera zu überlassen.</translation>
    </message>
    <message>
        <source>{name}, slider</source>
        <translation>{name}, Regler</translation>
    </message>
    <message>
        <source>There is no result yet.</source>
        <translation>Es gibt noch kein Ergebnis.</translation>
    </message>
    <message>
        <source>Looking for the board in the films</source>
        <translation>Das Brett wird in den Filmen gesucht</translation>
    </message>
    <message>
        <source>Choose the film of {missing}, too.</source>
        <translation>Auch den Film von {missing} auswählen.</translation>
    </message>
    <message>
        <source>Or go back to the live cameras.</source>
        <translation>Oder zurück zu den Live-Kameras.</translation>
    </message>
    <message>
        <source>Choose another film, or the live cameras.</source>
        <translation>Einen anderen Film oder die Live-Kameras wählen.</translation>
    </message>
    <message>
        <source>One moment: films are read.</source>
        <translation>Einen Moment: Filme werden gelesen.</translation>
    </message>
    <message>
        <source>{shots} frames were chosen.</source>
        <translation>{shots} Bilder wurden ausgewählt.</translation>
    </message>
    <message>
        <source>Press Next. Better: a film in which the board comes to all parts of the picture.</source>
        <translation>Weiter drücken. Besser: ein Film, in dem das Brett in alle Teile des Bildes kommt.</translation>
    </message>
    <message>
        <source>Too few: film the board in more places, still in each.</source>
        <translation>Zu wenige: das Brett an mehr Orten filmen, an jedem still.</translation>
    </message>
    <message>
        <source>Films began together</source>
        <translation>Filme begannen gemeinsam</translation>
    </message>
    <message>
        <source>How it is known by how much one film began later than the other: by what all cameras heard, or by a light that went on once.</source>
        <translation>Woher bekannt ist, um wie viel ein Film später begann als der andere: durch etwas, das alle Kameras hörten, oder durch ein Licht, das einmal anging.</translation>
    </message>
    <message>
        <source>Live cameras</source>
        <translation>Live-Kameras</translation>
    </message>
    <message>
        <source>Films are left out; views are taken of the live cameras again.</source>
        <translation>Filme bleiben weg; Ansichten kommen wieder von den Live-Kameras.</translation>
    </message>
    <message>
        <source>A recorded film of the board in place of the live camera: move the board, rest it for half a second, and move it on. Frames are chosen by themselves.</source>
        <translation>Ein aufgenommener Film des Bretts statt der Live-Kamera: das Brett bewegen, eine halbe Sekunde ruhen lassen und weiterbewegen. Bilder werden von selbst ausgewählt.</translation>
    </message>
    <message>
        <source>Use a film of {camera} …</source>
        <translation>Film von {camera} verwenden …</translation>
    </message>
    <message>
        <source>Film of {camera}</source>
        <translation>Film von {camera}</translation>
    </message>
    <message>
        <source>current</source>
        <translation>aktuell</translation>
    </message>
    <message>
        <source>to come</source>
        <translation>kommt noch</translation>
    </message>
    <message>
        <source>Escape. Nothing is saved before &quot;Use this calibration&quot;.</source>
        <translation>Escape. Vor „Diese Kalibrierung benutzen“ wird nichts gespeichert.</translation>
    </message>
    <message>
        <source>Back</source>
        <translation>Zurück</translation>
    </message>
    <message>
        <source>Alt+Left. Nothing is lost.</source>
        <translation>Alt+Links. Nichts geht verloren.</translation>
    </message>
    <message>
        <source>Next</source>
        <translation>Weiter</translation>
    </message>
    <message>
        <source>Simulated hand does …</source>
        <translation>Was die simulierte Hand tut …</translation>
    </message>
    <message>
        <source>The simulated rig only: what stands before its cameras.</source>
        <translation>Nur das simulierte Rig: was vor seinen Kameras steht.</translation>
    </message>
    <message>
        <source>Begin again</source>
        <translation>Neu beginnen</translation>
    </message>
    <message>
        <source>{sentence} {left:.0f} s left.</source>
        <translation>{sentence} Noch {left:.0f} s.</translation>
    </message>
    <message>
        <source>{shortfall} Record again.</source>
        <translation>{shortfall} Noch einmal aufnehmen.</translation>
    </message>
    <message>
        <source>Recorded. Go on, or record again.</source>
        <translation>Aufgenommen. Weiter oder noch einmal aufnehmen.</translation>
    </message>
    <message>
        <source>time</source>
        <translation>Zeit</translation>
    </message>
    <message>
        <source>of {seconds:.0f} s recorded</source>
        <translation>von {seconds:.0f} s aufgenommen</translation>
    </message>
    <message>
        <source>markers measured by the cameras at this moment</source>
        <translation>Marker, die die Kameras in diesem Augenblick messen</translation>
    </message>
    <message>
        <source>The engine records what the cameras send, into a file that goes when this window closes.</source>
        <translation>Die Engine zeichnet auf, was die Kameras senden, in eine Datei, die mit diesem Fenster verschwindet.</translation>
    </message>
    <message>
        <source>Record again</source>
        <translation>Noch einmal aufnehmen</translation>
    </message>
    <message>
        <source>Space. Begins or ends the recording; it ends by itself when the time is over.</source>
        <translation>Leertaste. Beginnt oder beendet die Aufnahme; sie endet von selbst, wenn die Zeit um ist.</translation>
    </message>
    <message>
        <source>before</source>
        <translation>vorher</translation>
    </message>
    <message>
        <source>after</source>
        <translation>nachher</translation>
    </message>
    <message>
        <source>Restore the old one</source>
        <translation>Die alte wiederherstellen</translation>
    </message>
    <message>
        <source>Brings back what was there before.</source>
        <translation>Holt zurück, was vorher da war.</translation>
    </message>
    <message>
        <source>Nothing was saved so far. {ways_back}</source>
        <translation>Bisher wurde nichts gespeichert. {ways_back}</translation>
    </message>
    <message>
        <source>Verdict: {word}. {sentence}</source>
        <translation>Urteil: {word}. {sentence}</translation>
    </message>
    <message>
        <source>Live picture of camera {name}</source>
        <translation>Live-Bild der Kamera {name}</translation>
    </message>
    <message>
        <source>A click shows this picture large.</source>
        <translation>Ein Klick zeigt dieses Bild groß.</translation>
    </message>
    <message>
        <source>Mend what the verdict says.</source>
        <translation>Beheben, was das Urteil sagt.</translation>
    </message>
    <message>
        <source>Look at the result, then go on.</source>
        <translation>Das Ergebnis ansehen, dann weiter.</translation>
    </message>
    <message>
        <source>Result</source>
        <translation>Ergebnis</translation>
    </message>
    <message>
        <source>Go back: nothing was recorded yet.</source>
        <translation>Zurückgehen: Noch wurde nichts aufgenommen.</translation>
    </message>
    <message>
        <source>It did not work out.</source>
        <translation>Es hat nicht geklappt.</translation>
    </message>
    <message>
        <source>Read what is wrong, then go back.</source>
        <translation>Lesen, was nicht stimmt, dann zurückgehen.</translation>
    </message>
    <message>
        <source>Before and after</source>
        <translation>Vorher und nachher</translation>
    </message>
    <message>
        <source>Use this calibration</source>
        <translation>Diese Kalibrierung benutzen</translation>
    </message>
    <message>
        <source>It is in use and saved.</source>
        <translation>Sie ist in Kraft und gespeichert.</translation>
    </message>
    <message>
        <source>The old one is back.</source>
        <translation>Die alte ist wieder da.</translation>
    </message>
    <message>
        <source>This must not be used: go back and mend what the verdict says.</source>
        <translation>Das darf nicht benutzt werden: zurückgehen und beheben, was das Urteil sagt.</translation>
    </message>
    <message>
        <source>Compare, then use this calibration or go back.</source>
        <translation>Vergleichen, dann diese Kalibrierung benutzen oder zurückgehen.</translation>
    </message>
    <message>
        <source>Close without using this calibration? What was captured here is lost; the calibration in force stays as it is.</source>
        <translation>Schließen, ohne diese Kalibrierung zu benutzen? Was hier aufgenommen wurde, geht verloren; die geltende Kalibrierung bleibt, wie sie ist.</translation>
    </message>
    <message>
        <source>Stopped. Go on with Begin again, or go back.</source>
        <translation>Angehalten. Weiter mit Neu beginnen oder zurückgehen.</translation>
    </message>
    <message>
        <source>The work was stopped.</source>
        <translation>Die Arbeit wurde angehalten.</translation>
    </message>
    <message>
        <source>The scale comes from the board&apos;s squares alone; a second length finds a wrong number. Next waits for one, or for Skip below.</source>
        <translation>Der Maßstab kommt allein aus den Feldern des Bretts; eine zweite Länge entdeckt eine falsche Zahl. Weiter wartet auf eine oder auf „Überspringen“ unten.</translation>
    </message>
    <message>
        <source>The rig file will say that no length was checked, and so will the app.</source>
        <translation>Die Rig-Datei und die App werden sagen, dass keine Länge geprüft wurde.</translation>
    </message>
    <message>
        <source>A known length</source>
        <translation>Eine bekannte Länge</translation>
    </message>
    <message>
        <source>Click both ends of the ruler in each picture, in the same order.</source>
        <translation>In jedem Bild beide Enden des Lineals anklicken, in derselben Reihenfolge.</translation>
    </message>
    <message>
        <source>Hold the ruler where both cameras see it, and press Space.</source>
        <translation>Das Lineal dorthin halten, wo beide Kameras es sehen, und die Leertaste drücken.</translation>
    </message>
    <message>
        <source>The scale will be checked: press Next.</source>
        <translation>Der Maßstab wird geprüft: Weiter drücken.</translation>
    </message>
    <message>
        <source>Lengths stay unproven: press Next.</source>
        <translation>Längen bleiben unbewiesen: Weiter drücken.</translation>
    </message>
    <message>
        <source>Measure a second length.</source>
        <translation>Eine zweite Länge messen.</translation>
    </message>
    <message>
        <source>Skip: lengths stay unproven</source>
        <translation>Überspringen: Längen unbewiesen</translation>
    </message>
    <message>
        <source>Shows a ruler: its crosses are {length_mm:g} mm apart.</source>
        <translation>„Zeigt ein Lineal“: Seine Kreuze sind {length_mm:g} mm auseinander.</translation>
    </message>
    <message>
        <source>The distance between the middles of the two lenses, measured by hand. 75 mm on the frame that the thesis describes.</source>
        <translation>Der Abstand zwischen den Mitten der beiden Objektive, von Hand gemessen. 75 mm an dem Gestell, das die Arbeit beschreibt.</translation>
    </message>
    <message>
        <source>The distance between two marks on a ruler, 200 mm for instance, that both cameras see.</source>
        <translation>Der Abstand zwischen zwei Marken auf einem Lineal, etwa 200 mm, die beide Kameras sehen.</translation>
    </message>
    <message>
        <source>Lens to lens</source>
        <translation>Objektivabstand</translation>
    </message>
    <message>
        <source>Space. Then click both ends of the ruler in each picture.</source>
        <translation>Leertaste. Dann in jedem Bild beide Enden des Lineals anklicken.</translation>
    </message>
    <message>
        <source>If the size of the squares was typed wrong, every length is wrong by the same factor and nothing will tell.</source>
        <translation>Wurde die Größe der Felder falsch eingetippt, ist jede Länge um denselben Faktor falsch, und nichts wird es verraten.</translation>
    </message>
    <message>
        <source>Do not skip</source>
        <translation>Nicht überspringen</translation>
    </message>
    <message>
        <source>not measured</source>
        <translation>nicht gemessen</translation>
    </message>
    <message>
        <source>not yet</source>
        <translation>noch nicht</translation>
    </message>
    <message>
        <source>This rig came from no file, so there are no earlier versions of it. Save it first.</source>
        <translation>Dieses Rig kam aus keiner Datei, daher gibt es keine früheren Fassungen. Es zuerst speichern.</translation>
    </message>
    <message>
        <source>today</source>
        <translation>heute</translation>
    </message>
    <message>
        <source>yesterday</source>
        <translation>gestern</translation>
    </message>
    <message numerus="yes">
        <source>{n} day ago</source>
        <comment>{n} days ago</comment>
        <translation>
            <numerusform>vor {n} Tag</numerusform>
            <numerusform>vor {n} Tagen</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>{n} month ago</source>
        <comment>{n} months ago</comment>
        <translation>
            <numerusform>vor {n} Monat</numerusform>
            <numerusform>vor {n} Monaten</numerusform>
        </translation>
    </message>
    <message>
        <source>from the left to the right edge</source>
        <translation>vom linken zum rechten Rand</translation>
    </message>
    <message>
        <source>from the upper to the lower edge</source>
        <translation>vom oberen zum unteren Rand</translation>
    </message>
    <message>
        <source>size</source>
        <translation>Größe</translation>
    </message>
    <message>
        <source>near enough to fill much of the picture</source>
        <translation>nah genug, um einen großen Teil des Bildes zu füllen</translation>
    </message>
    <message>
        <source>skew</source>
        <translation>Neigung</translation>
    </message>
    <message>
        <source>tilted, which tells the focal length</source>
        <translation>geneigt, das zeigt die Brennweite</translation>
    </message>
    <message>
        <source>Camera and board</source>
        <translation>Kamera und Brett</translation>
    </message>
    <message>
        <source>Show the board</source>
        <translation>Das Brett zeigen</translation>
    </message>
    <message>
        <source>the first step is not done without a board</source>
        <translation>der erste Schritt ist ohne Brett nicht erledigt</translation>
    </message>
    <message>
        <source>Show the whole board to the camera.</source>
        <translation>Der Kamera das ganze Brett zeigen.</translation>
    </message>
    <message>
        <source>picture</source>
        <translation>Bild</translation>
    </message>
    <message>
        <source>parts of the picture in which corners were seen</source>
        <translation>Teile des Bildes, in denen Ecken gesehen wurden</translation>
    </message>
    <message>
        <source>{count} pictures taken.</source>
        <translation>{count} Bilder aufgenommen.</translation>
    </message>
    <message>
        <source>Estimating the intrinsics</source>
        <translation>Die Intrinsik wird geschätzt</translation>
    </message>
    <message>
        <source>arrows: residuals × {times:,.0f}</source>
        <translation>Pfeile: Residuen × {times:,.0f}</translation>
    </message>
    <message>
        <source>Whose intrinsics are calibrated. One camera at a time.</source>
        <translation>Wessen Intrinsik kalibriert wird. Eine Kamera nach der anderen.</translation>
    </message>
    <message>
        <source>Straighten the picture</source>
        <translation>Bild entzerren</translation>
    </message>
    <message>
        <source>Shows the live picture without the lens&apos;s distortion: hold a ruler before the camera, it must be straight everywhere.</source>
        <translation>Zeigt das Live-Bild ohne die Verzeichnung des Objektivs: Ein Lineal vor der Kamera muss überall gerade sein.</translation>
    </message>
    <message>
        <source>Pixels are square</source>
        <translation>Pixel sind quadratisch</translation>
    </message>
    <message>
        <source>Forces one focal length for both directions, as nearly every sensor has it. Fewer numbers to find need fewer views.</source>
        <translation>Erzwingt eine Brennweite für beide Richtungen, wie fast jeder Sensor sie hat. Weniger Unbekannte brauchen weniger Ansichten.</translation>
    </message>
    <message>
        <source>How well each view fits. Arrows in the picture are the mean residual of each part: a pattern in them is something that the lens model does not explain.</source>
        <translation>Wie gut jede Ansicht passt. Pfeile im Bild sind das mittlere Residuum jedes Teils: Ein Muster darin ist etwas, das das Objektivmodell nicht erklärt.</translation>
    </message>
    <message>
        <source>Calibrating the cameras</source>
        <translation>Die Kameras werden kalibriert</translation>
    </message>
    <message>
        <source>Show the board to both cameras.</source>
        <translation>Das Brett beiden Kameras zeigen.</translation>
    </message>
    <message>
        <source>shots that both cameras share</source>
        <translation>Aufnahmen, die beide Kameras teilen</translation>
    </message>
    <message>
        <source>{shots} shots</source>
        <translation>{shots} Aufnahmen</translation>
    </message>
    <message>
        <source>every camera shares enough shots with another</source>
        <translation>jede Kamera teilt genügend Aufnahmen mit einer anderen</translation>
    </message>
    <message>
        <source>{name} covered</source>
        <translation>{name} abgedeckt</translation>
    </message>
    <message>
        <source>part of the picture where the board was</source>
        <translation>Teil des Bildes, in dem das Brett war</translation>
    </message>
    <message>
        <source>tilted</source>
        <translation>geneigt</translation>
    </message>
    <message>
        <source>the board was seen tilted: this tells the focal length</source>
        <translation>das Brett wurde geneigt gesehen: Das zeigt die Brennweite</translation>
    </message>
    <message>
        <source>near and far</source>
        <translation>nah und fern</translation>
    </message>
    <message>
        <source>the board was seen large and small</source>
        <translation>das Brett wurde groß und klein gesehen</translation>
    </message>
    <message>
        <source>Hold the board still.</source>
        <translation>Das Brett still halten.</translation>
    </message>
    <message>
        <source>The table</source>
        <translation>Der Tisch</translation>
    </message>
    <message>
        <source>Lay the board flat on the table and press Space, or press Next.</source>
        <translation>Das Brett flach auf den Tisch legen und die Leertaste drücken, oder Weiter drücken.</translation>
    </message>
    <message>
        <source>Without a table the world begins at camera {first}, and the scene is not level.</source>
        <translation>Ohne Tisch beginnt die Welt bei Kamera {first}, und die Szene liegt nicht waagerecht.</translation>
    </message>
    <message>
        <source>Lay the board flat and press Space again.</source>
        <translation>Das Brett flach hinlegen und noch einmal die Leertaste drücken.</translation>
    </message>
    <message>
        <source>The table is known: press Next.</source>
        <translation>Der Tisch ist bekannt: Weiter drücken.</translation>
    </message>
    <message>
        <source>Earlier calibrations</source>
        <translation>Frühere Kalibrierungen</translation>
    </message>
    <message>
        <source>Bring it back</source>
        <translation>Zurückholen</translation>
    </message>
    <message>
        <source>Puts the chosen version into force. What is there now is kept, and can be brought back the same way.</source>
        <translation>Setzt die gewählte Fassung in Kraft. Was jetzt gilt, bleibt erhalten und lässt sich ebenso zurückholen.</translation>
    </message>
    <message>
        <source>{date}
before {reason}</source>
        <translation>{date}
vor {reason}</translation>
    </message>
    <message>
        <source>Nothing has been replaced yet: there is no earlier calibration of this rig.</source>
        <translation>Noch wurde nichts ersetzt: Es gibt keine frühere Kalibrierung dieses Rigs.</translation>
    </message>
    <message>
        <source>This version says the same as the rig does now.</source>
        <translation>Diese Fassung sagt dasselbe wie das Rig jetzt.</translation>
    </message>
    <message>
        <source>It is back in force. What was there before stands first in the list now.</source>
        <translation>Sie gilt wieder. Was vorher da war, steht jetzt zuerst in der Liste.</translation>
    </message>
    <message>
        <source>The numerical code of other trackers and of calibrations could not be compiled, so that they begin slowly: {reason}</source>
        <translation>Der Rechencode anderer Tracker und der Kalibrierungen ließ sich nicht übersetzen; sie beginnen deshalb langsam: {reason}</translation>
    </message>
    <message>
        <source>The code of other trackers and of calibrations is being compiled in the background, once: {done} of {steps} steps. It yields to the tracking, and takes minutes.</source>
        <translation>Der Rechencode anderer Tracker und der Kalibrierungen wird einmalig im Hintergrund übersetzt: {done} von {steps} Schritten. Er weicht der Verfolgung und braucht Minuten.</translation>
    </message>
    <message>
        <source>{path} already exists. Write over it?</source>
        <translation>{path} gibt es schon. Überschreiben?</translation>
    </message>
</context>
</TS>
