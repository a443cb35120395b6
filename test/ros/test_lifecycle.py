# SPDX-License-Identifier: Apache-2.0
"""The planner's life cycle through the services that `ros2 lifecycle` calls."""

from typing import Any

import pytest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from planner_talk import FREE, GOAL, LOCKSTEP, PlannerHarness, fields, goal, mode, odom, sectors
from ros_graph import Graph
from std_srvs.srv import Trigger

from mfba_planner.core.planner_types import Mode
from mfba_planner.recording.from_messages import decision as read_decision
from mfba_planner.ros.interface import topics
from mfba_planner.ros.nodes.planner import PlannerNode

OUTPUTS = (topics.GOAL_STEP, topics.CMD_VEL, topics.PLAN, topics.DECISION, topics.MARKERS)
NAMES = {
    "configure": Transition.TRANSITION_CONFIGURE,
    "activate": Transition.TRANSITION_ACTIVATE,
    "deactivate": Transition.TRANSITION_DEACTIVATE,
    "cleanup": Transition.TRANSITION_CLEANUP,
}


def state(graph: Graph) -> str:
    label: str = graph.call(GetState, "planner/get_state").current_state.label
    return label


def change(graph: Graph, name: str) -> bool:
    request = ChangeState.Request(transition=Transition(id=NAMES.get(name, 0), label=name))
    done: bool = graph.call(ChangeState, "planner/change_state", request).success
    return done


def offers(graph: Graph) -> set[str]:
    return {t.name for t in OUTPUTS if graph.probe.count_publishers(t.name)}


def test_by_default_it_is_active_at_once(graph: Graph) -> None:
    harness = PlannerHarness(graph, LOCKSTEP)
    assert state(graph) == "active"
    assert mode(harness.decide(odom(1), sectors(1))) is Mode.PATH_GENERATION


def test_without_autostart_it_changes_state_by_service(graph: Graph) -> None:
    node = graph.start(PlannerNode, {"autostart": False})
    received = graph.collect(topics.DIAGNOSTICS)
    assert (state(graph), node.missing()) == ("unconfigured", "unconfigured, not active")
    assert not offers(graph)
    assert not change(graph, "activate"), "not before it is configured"
    assert change(graph, "configure")
    assert state(graph) == "inactive"
    assert offers(graph) == {topic.name for topic in OUTPUTS}
    ready = graph.call(Trigger, "planner/ready")
    assert (ready.success, ready.message) == (False, "inactive, not active")
    assert change(graph, "activate")
    assert graph.call(Trigger, "planner/ready").success
    graph.until(lambda: "active" in states(received))
    assert change(graph, "deactivate")
    assert change(graph, "cleanup")
    graph.until(lambda: not offers(graph))
    assert state(graph) == "unconfigured"


def states(received: list[Any]) -> list[str]:
    return [v.value for message in received for v in message.status[1].values if v.key == "state"]


def test_deactivated_it_commands_rest_once_and_nothing_more(graph: Graph) -> None:
    harness = PlannerHarness(graph, LOCKSTEP)
    harness.decide(odom(1), sectors(1))
    assert harness.velocity != (0.0, 0.0)
    assert change(graph, "deactivate")
    graph.settle()
    assert len(harness.cmd_vel) == 2
    assert harness.velocity == (0.0, 0.0)
    position = harness.goal_steps[-1].pose.position
    assert (position.x, position.y) == (0.0, 0.0), "where the robot is"
    counts = [
        len(x) for x in (harness.cmd_vel, harness.goal_steps, harness.plans, harness.decisions)
    ]
    for stamp in (2, 3):
        harness.odom.publish(odom(stamp))
        harness.sectors.publish(sectors(stamp))
    graph.settle()
    assert [
        len(x) for x in (harness.cmd_vel, harness.goal_steps, harness.plans, harness.decisions)
    ] == counts


@pytest.mark.parametrize("lockstep", [True, False])
def test_activated_again_it_goes_on_to_its_goal(graph: Graph, lockstep: bool) -> None:
    harness = PlannerHarness(graph, {**LOCKSTEP, "lockstep": lockstep, "input_timeout_s": 60.0})
    harness.odom.publish(odom(1))
    graph.settle()
    harness.sectors.publish(sectors(1))
    graph.until(lambda: len(harness.decisions) == 1)
    assert change(graph, "deactivate")
    assert change(graph, "activate")
    harness.odom.publish(odom(2, 1.0))
    graph.settle()
    harness.sectors.publish(sectors(2))
    graph.until(lambda: len(harness.decisions) == 2)
    decision = read_decision(harness.decisions[-1], FREE)
    assert (decision.mode, decision.goal) == (Mode.PATH_GENERATION, GOAL)


def test_a_goal_given_while_it_is_inactive_is_kept(graph: Graph) -> None:
    harness = PlannerHarness(graph, LOCKSTEP, at=None)
    assert change(graph, "deactivate")
    harness.goal.publish(goal(2.0, 2.0))
    graph.settle()
    assert change(graph, "activate")
    assert fields(harness.decide(odom(1), sectors(1)))["goal"] == "2.0,2.0"


def test_cleaned_up_it_has_no_goal_and_receives_the_latched_one_again(graph: Graph) -> None:
    harness = PlannerHarness(graph, LOCKSTEP)
    for name in ("deactivate", "cleanup"):
        assert change(graph, name)
    assert harness.node.goals.goal_queue.goal is None
    for name in ("configure", "activate"):
        assert change(graph, name)
    graph.until(lambda: harness.node.goals.goal_queue.goal == GOAL)
    assert mode(harness.decide(odom(1), sectors(1))) is Mode.PATH_GENERATION


@pytest.mark.parametrize("path", [[], ["deactivate"], ["deactivate", "cleanup"]])
def test_shut_down_from_anywhere_the_process_ends(graph: Graph, path: list[str]) -> None:
    harness = PlannerHarness(graph, LOCKSTEP)
    for name in path:
        assert change(graph, name)
    assert change(graph, "shutdown")
    assert state(graph) == "finalized"
    assert harness.node.finished
    assert offers(graph) == set()


def test_without_parameter_services_it_has_no_life_cycle_services(graph: Graph) -> None:
    node = graph.start(PlannerNode, LOCKSTEP, start_parameter_services=False)
    assert node.is_active
    offered = dict(graph.probe.get_service_names_and_types())
    assert "/planner/change_state" not in offered
