// g++ -O2 -o random_search random_search.cpp; nlp-gait compare nao-ssp --algorithms 'cmd:./random_search'
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <random>
#include <string>
#include <vector>

std::vector<double> read(const std::string& line, const std::string& key) {  // numbers of a key; NaN for null
  std::vector<double> found;
  size_t at = line.find("\"" + key + "\": ");
  if (at == std::string::npos) return found;
  const char* p = line.c_str() + at + key.size() + 4;
  bool many = *p == '[';
  for (p += many; *p != ']'; p += strspn(p, ", ")) {
    char* end;
    found.push_back(strncmp(p, "null", 4) ? strtod(p, &end) : (end = const_cast<char*>(p) + 4, NAN));
    p = end;
    if (!many) break;
  }
  return found;
}

int main() {
  std::string line;
  std::getline(std::cin, line);
  auto lower = read(line, "lower"), upper = read(line, "upper");
  std::mt19937 random(static_cast<unsigned>(read(line, "seed")[0]));
  while (line.find("\"stop\"") == std::string::npos) {
    for (int row = 0; row < 100; row++)
      for (size_t k = 0; k < lower.size(); k++)
        printf("%s%.17g", k ? "," : row ? "],[" : "{\"x\": [[", lower[k] + (upper[k] - lower[k]) * (random() / 4294967296.0));
    printf("]]}\n");
    fflush(stdout);
    std::getline(std::cin, line);  // {"f": [...], "violation": [...], "cost": [...]}: read(line, "cost") for a real search
  }
}
