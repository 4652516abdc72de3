"""Several servers as one service: PostgreSQL, HAProxy, and two servers of which one is killed. tools/service_cluster is the long form."""
import signal

import cluster
import harness
import pytest


@pytest.mark.skipif(bool(cluster.missing()), reason="there is no " + ", no ".join(cluster.missing()))
class TestTwoServers(harness.InFolder):
    @classmethod
    def prepare(cls):
        cls.maps = cluster.make_maps(cls.folder)
        cls.cluster = cluster.Cluster(cls.folder)
        cls.cleanup.callback(cls.cluster.end)
        cls.images, cls.camera = cluster.images_of("query_around", cls.folder, 0, 60, 6), cluster.camera_of("query_around")
        cls.truths = {}
        for path in reversed(cls.maps):
            cls.cluster.put("desk", path)
            digest, positions = cluster.truth_of(cls.cluster.haproxy.client(), "desk", cls.images, cls.camera)
            assert sum(p is not None for p in positions) > len(positions) / 2, positions
            cls.truths[digest] = positions
        assert len(cls.truths) == 2

    def load(self, clients=4):
        load = cluster.Load(self.cluster.haproxy.client, "desk", self.images, self.camera, clients)
        load.truths = self.truths
        return load

    def test_a_killed_server_costs_no_answer(self):
        with self.load() as load:
            _, failures = cluster.kill_a_server(self.cluster, load, 40)
        assert failures == []
        assert load.mixtures() == []

    def test_websockets_go_on_at_the_other_server(self, request):
        victim = self.cluster.servers[0]
        before = [cluster.track(self.cluster.haproxy, "desk") for _ in range(4)]
        request.addfinalizer(lambda: [connection.close() for connection, _ in before])
        victim.end(signal.SIGKILL)
        request.addfinalizer(victim.start)
        for _ in before:
            connection, hello = cluster.track(self.cluster.haproxy, "desk")
            connection.close()
            assert (hello["type"], hello["map"]) == ("hello", "desk")
            assert hello["digest"] in self.truths

    def test_a_map_is_replaced_under_load(self):
        with self.load() as load:
            cluster.replace_the_map(self.cluster, load, self.maps, 4, 40)
        assert load.failures() == []
        assert load.mixtures() == []
        assert load.digests() == set(self.truths)

    def test_the_database_is_gone_for_a_while(self):
        with self.load() as load:
            slowest = cluster.break_the_database(self.cluster, load, 3)
        assert slowest < 20  # what needs the database is refused, and does not hang
        assert load.failures() == []
        assert load.mixtures() == []
