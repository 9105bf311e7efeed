#!/usr/bin/env python3
"""Drops a file onto an X11 window as a desktop would (XDND version 5): drop_file.py WINDOW-ID PATH.

Plays the source of the drag: announces, hovers, drops, answers the request for the list of URIs, waits for the end.
"""
import os
import sys
import time
import urllib.parse

from Xlib import X, Xatom, display
from Xlib.protocol import event

d = display.Display()
target = d.create_resource_object("window", int(sys.argv[1]))
uri = "file://" + urllib.parse.quote(os.path.abspath(sys.argv[2])) + "\r\n"
screen = d.screen()
source = screen.root.create_window(0, 0, 1, 1, 0, screen.root_depth)
atom = d.intern_atom
uri_list, selection = atom("text/uri-list"), atom("XdndSelection")
source.set_selection_owner(selection, X.CurrentTime)


def send(name, data):
    message = event.ClientMessage(window=target, client_type=atom(name), data=(32, data))
    target.send_event(message)
    d.flush()


def answer(seconds, until):
    """Answers requests for the list of URIs; gives the message named `until`, or None when time is up."""
    deadline = time.time() + seconds
    while time.time() < deadline:
        while d.pending_events():
            e = d.next_event()
            if e.type == X.SelectionRequest:
                e.requestor.change_property(e.property, uri_list, 8, uri.encode())
                e.requestor.send_event(
                    event.SelectionNotify(
                        time=e.time, requestor=e.requestor, selection=e.selection, target=e.target, property=e.property
                    )
                )
                d.flush()
            elif e.type == X.ClientMessage and e.client_type == atom(until):
                return e
        time.sleep(0.01)
    return None


geometry = target.get_geometry()
corner = target.translate_coords(screen.root, 0, 0)
x, y = -corner.x + geometry.width // 2, -corner.y + geometry.height // 2
send("XdndEnter", [source.id, 5 << 24, uri_list, 0, 0])
for _ in range(3):
    send("XdndPosition", [source.id, 0, (x << 16) | y, X.CurrentTime, atom("XdndActionCopy")])
    if answer(20, "XdndStatus") is None:
        sys.exit("the window did not answer the hovering file within 20 seconds")
    answer(0.3, "XdndStatus")
send("XdndDrop", [source.id, 0, X.CurrentTime, 0, 0])
finished = answer(20, "XdndFinished")
if finished is None:
    sys.exit("the window did not finish the drop within 20 seconds")
if not finished.data[1][1] & 1:
    sys.exit("the window refused the file")
